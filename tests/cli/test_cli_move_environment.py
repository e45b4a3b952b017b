"""`zwidth move --environment`: every environment of `zwidth simulate` at a surface, by its options and keys."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth as package
from tests.cli.command_runner import MECHANISM, document_of, run_command
from zwidth.contact import ENVIRONMENTS

PLANE = ("--plane", "0,0.252,0,-1")
PUSH = ("--push", "0,1", "--duration", 0.1)
OWN = (
    "import math\n"
    "from zwidth.contact.environments import Parameter, environment\n"
    "@environment([Parameter('level', 'N', 0.5)])\n"
    "def push(position, velocity, time, period, parameters, memory):\n"
    "    'Pushes out, inside.'\n"
    "    return -parameters[0] if position > 0.0 else 0.0\n"
    "@environment([])\n"
    "def silent(position, velocity, time, period, parameters, memory):\n"
    "    return math.nan if time > 0.01 else 0.0\n"
)


def move_document(*words):
    return document_of("move", MECHANISM, *PLANE, *PUSH, *words)


def move_from_python(wall, **settings):
    plane = package.contact.Plane((0.0, 0.252), (0.0, -1.0), **settings)
    return package.load(MECHANISM).at().move(wall, plane, push=(0.0, 1.0, 0.0), duration=0.1)


@pytest.fixture
def user_environment(tmp_path):
    file = tmp_path / "own.py"
    file.write_text(OWN)
    return lambda name: f"{file}:{name}"


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_every_environment_is_that_of_python_and_named_as_simulate_names_it(name):
    document = move_document("--environment", name)
    environment = ENVIRONMENTS[name]
    motion = move_from_python(package.contact.SurfaceEnvironment(environment, environment.values()))
    assert document["force_N"] == motion.force.tolist()
    assert document["position_m"] == motion.position.tolist()
    assert np.any(motion.force)
    known = document_of("simulate", MECHANISM, "--environment", name, "--duration", 0.01)
    for key in ("environment", "parameters", "wall_stiffness_N_per_m", "wall_damping_Ns_per_m"):
        assert document[key] == known[key], key
    assert document["no_pull"] is False
    assert document["surface"]["two_sided"] is (name == "wall")


def test_parameters_come_by_their_option_and_by_those_of_walls():
    words = ("--environment", "slot", "--parameter", "width=0.004", "--parameter", "damping=3")
    document = move_document(*words, "--stiffness", 700, "--no-pull")
    assert document["environment"] == "slot"
    assert document["parameters"] == {"width": 0.004, "stiffness": 700.0, "damping": 3.0, "no_pull": 1.0}
    assert (document["wall_stiffness_N_per_m"], document["wall_damping_Ns_per_m"]) == (700.0, 3.0)
    assert document["no_pull"] is True
    values = ENVIRONMENTS["slot"].values(width=0.004, stiffness=700.0, damping=3.0, no_pull=1)
    motion = move_from_python(package.contact.SurfaceEnvironment(ENVIRONMENTS["slot"], values))
    assert document["force_N"] == motion.force.tolist()
    out = run_command("move", MECHANISM, *PLANE, *PUSH, *words, "--no-pull").out
    said = "slot: width 4.000 mm, stiffness 1.000 kN/m, damping 3.000 N s/m, no pull"
    assert said in " ".join(out.split())


def test_a_wall_of_stiffness_and_damping_is_named_too():
    gains = ("--stiffness", 900, "--damping", 2)
    for words, name, motion in (
        ((), "one-sided wall", move_from_python(package.contact.SurfaceWall(900.0, 2.0))),
        (
            ("--no-pull",),
            "one-sided wall",
            move_from_python(package.contact.SurfaceWall(900.0, 2.0, no_pull=True)),
        ),
        (("--two-sided",), "wall", move_from_python(package.contact.SurfaceWall(900.0, 2.0), two_sided=True)),
    ):
        document = move_document(*gains, *words)
        assert document["environment"] == name
        assert (document["wall_stiffness_N_per_m"], document["wall_damping_Ns_per_m"]) == (900.0, 2.0)
        assert document["no_pull"] is ("--no-pull" in words)
        assert document["force_N"] == motion.force.tolist()
    plain = move_document(*gains, "--two-sided")
    assert move_document(*gains, "--environment", "wall") == plain
    assert plain["contact_share"] == 1.0
    free = document_of("move", MECHANISM, *PUSH)
    assert free["environment"] is free["parameters"] is free["no_pull"] is None


def test_energies_add_up_with_an_environment():
    words = ("--environment", "friction_patch", "--parameter", "friction=0.3")
    book = move_document(*words, "--set", "mechanism.damping.mode_ratio=0", "--substeps", 8)["energy_book_J"]
    assert book["motors"] < -0.1 * book["hand"]
    assert abs(book["dampers"]) < 1e-6 * book["hand"]


def test_an_environment_of_my_own(user_environment):
    document = move_document("--environment", user_environment("push"), "--parameter", "level=0.7")
    force = np.array(document["force_N"])[:, 1]
    seen = np.array(document["counted_position_m"])[:, 1]
    assert force == pytest.approx(np.where(seen > 0.252, -0.7, 0.0), abs=1e-15)
    assert 0.0 < np.mean(seen > 0.252) < 1.0


def test_a_law_that_gives_no_number_has_no_answer(user_environment):
    ran = run_command("move", MECHANISM, *PLANE, *PUSH, "--environment", user_environment("silent"), "--json")
    assert (ran.code, ran.document["status"], ran.document["environment"]) == (1, None, None)
    assert "after 0.01125 s silent" in ran.document["reason"]


@pytest.mark.parametrize("name", ["hunt_crossley", "texture", "wall"])
def test_a_figure_is_drawn_of_it(tmp_path, name):
    file = tmp_path / "path.png"
    move_document("--environment", name, "--output", file)
    assert file.stat().st_size > 10_000
