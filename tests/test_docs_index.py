"""The index of words leads to sections that answer, the glossary to names that exist; new examples run."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields, is_dataclass
from operator import attrgetter
from pathlib import Path

import control
import mujoco
import numpy as np
import pytest
from scipy.signal import chirp, lfilter
from scipy.spatial.transform import Rotation

import zwidth
from tests.model.model_engines import mass_matrix
from tests.pages import sections
from zwidth.device.schema import device_file
from zwidth.measures import MEASURES
from zwidth.show import zwidth as commands

DOCS = Path(__file__).parents[1] / "docs"

ANSWERS = {
    "admittance": "force over velocity",
    "backlash": "range of the drive's stiffness",
    "Bode plot": "plant_response",
    "buzzing": "zwidth check",
    "cable drive": "motor turns per joint turn",
    "condition number": "singular value",
    "Coulomb friction": "coulomb_N",
    "CSV": ".csv",
    "delay": "delay_samples",
    "delta robot": "three legs",
    "describing function": "its describing function",
    "dexterity": "√det(J Jᵀ)",
    "effective mass": "1 / (hᵀ M_φ⁻¹ h)",
    "encoder resolution": "resolution_m",
    "energy leak": "a sampled spring makes energy",
    "equilibrium": "the hand's force on the handle",
    "flexible joint": "stiffness_Nm_per_rad",
    "flexible link": "finite elements",
    "friction": "breakaway_N",
    "gravity": "gravity",
    "grip": "580 N/m",
    "hand tremor": "--tremor",
    "human arm impedance": "0.8 kg",
    "hysteresis": "1 + i eta",
    "inertia": "links and rotors as one mass",
    "installation": "make report",
    "isotropy": "largest over smallest singular value",
    "load": "gravity_m_per_s2",
    "Jacobian": "handle velocity = J p'",
    "jitter": "loop.delay_samples=0,1",
    "Kalman": "gains that two noise figures call for",
    "latency": "time from a reading to the moment its force acts",
    "limit cycle": "held at some amplitude",
    "preload": "preload_Nm",
    "sideways motion": "its roots stay at z = 1",
    "musculoskeletal arm": "joint_stiffness_Nm_per_rad",
    "manipulability": "product of the singular values",
    "MATLAB export": "savemat",
    "maximum force": "torque limit",
    "maximum stiffness": "largest stiffness",
    "measured frequency response": "force_command_N",
    "motor torque limit": "minᵢ nᵢτᵢ",
    "noise": "noise [mm/s]",
    "Nyquist": "Nyquist frequency",
    "one-sided wall": "--wall one-sided",
    "operator": "thesis-arm",
    "passivity": "Colgate and Schenkel",
    "prismatic joint": "prismatic",
    "quantisation": "step · round",
    "quantization": "step · round",
    "real time": "your controller runs it",
    "rendered impedance": "commanded",
    "Routh-Hurwitz": "Routh's array",
    "sampling frequency": "1/T times a second",
    "sampling rate": "1/T times a second",
    "saturation": "largest force that is commanded",
    "sensitivity": "d ln K_max",
    "Simulink": "State-Space block",
    "sine sweep": "sine sweep from 0.5 to 500 Hz",
    "singularity": "drives lose the handle",
    "spectral radius": "largest \\|z\\|",
    "stable region": "every motion dies out",
    "stiffness limit": "largest stiffness",
    "teleoperation": "two-port",
    "texture": "slope of a sine",
    "tolerance": "which tolerance is worth tightening",
    "uncertainty": "known in ranges",
    "transparency": "free motion",
    "units": "SI throughout",
    "URDF": "orientation_rad",
    "velocity filter": "butterworth",
    "vibration": "less damping helps",
    "virtual coupling": "Llewellyn",
    "virtual damping": "f = -(K x + B v)",
    "workspace": "map",
    "Z-width": "range of impedances",
}


def section(target: str) -> str:
    """The text of the section that a link of the index leads to, up to the next heading of any level."""
    name, _, anchor = target.partition("#")
    return sections(DOCS / (name or "index.md"))[anchor]


def index_of_words() -> dict[str, str]:
    """Each word of the index and the target beside it."""
    rows = re.findall(r"^\| (.+?) \| \[.+\]\((\S+)\) \|$", section("#words"), re.MULTILINE)
    return {word: target for words, target in rows for word in words.split(", ")}


@pytest.mark.parametrize("word", ANSWERS)
def test_a_word_of_the_index_leads_to_its_answer(word):
    target = index_of_words()[word]
    assert ANSWERS[word] in " ".join(section(target).split()), target


def test_the_index_names_each_word_once_in_alphabetical_order():
    words = re.findall(r"^\| (.+?) \| \[", section("#words"), re.MULTILINE)
    assert words == sorted(words, key=str.casefold)
    single = [word for row in words for word in row.split(", ")]
    assert len(single) == len(set(single)) >= 100


# --- glossary ---------------------------------------------------------------------------------------


def glossary_rows() -> list[list[str]]:
    """Term, meaning, unit, what computes it and link of each row."""
    text = (DOCS / "glossary.md").read_text(encoding="utf-8").partition("## Words that are not used")[0]
    rows = [re.split(r" *(?<!\\)\| *", line)[1:-1] for line in text.splitlines() if line.startswith("| ")]
    return [row for row in rows if row[0] != "Term"]


NAMES = sorted({name for row in glossary_rows() for name in re.findall(r"`([^`]+)`", row[3])})


def test_the_glossary_is_in_alphabetical_order_and_every_term_is_explained_on_a_page():
    rows = glossary_rows()
    terms = [row[0] for row in rows]
    assert len(terms) >= 60
    assert terms == sorted(terms, key=lambda term: re.sub(r"\W+", " ", term.partition(" (")[0].casefold()))
    for row in rows:
        assert len(row) == 5, row
        assert row[1].endswith("."), row
        assert re.search(r"\]\([\w-]+\.md", row[4]), row


@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith("zwidth ")])
def test_a_command_of_the_glossary_exists(name):
    _, command, *options = name.split()
    known = {option for one in commands.commands[command].params for option in one.opts}
    assert {option for option in options if option.startswith("--")} <= known
    if "--measure" in options:
        assert options[-1] in MEASURES


@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith("--")])
def test_an_option_of_the_glossary_is_one_of_the_chart(name):
    assert name in {option for one in commands.commands["chart"].params for option in one.opts}


LISTS = {"drives", "electrical_damping"}  # keys of a device file that hold several tables
CLASSES = {
    "chart": zwidth.StabilityChart,
    "device": zwidth.Device,
    "loop": zwidth.Loop,
    "point": zwidth.OperatingPoint,
}


@pytest.mark.parametrize("name", [name for name in NAMES if re.match(r"[a-z]+\.", name)])
def test_a_python_name_or_key_of_the_glossary_exists(name):
    first, rest = name.split(".", 1)
    if first == "zwidth":
        attrgetter(rest)(zwidth)
        return
    path = tuple(part for key in name.split(".") for part in ((key, 0) if key in LISTS else (key,)))
    in_file = path[-1] == 0 or path[-1] in device_file.keys(path[:-1])
    owner = CLASSES.get(first)
    in_class = owner is not None and (
        hasattr(owner, rest) or (is_dataclass(owner) and rest in {field.name for field in fields(owner)})
    )
    assert in_file or in_class


# --- what the sections show -------------------------------------------------------------------------


def test_the_matrices_of_the_page_on_the_chart_are_the_loop(tmp_path, monkeypatch):
    """The sampled state space has the frequency response, by python-control; the file holds what was saved."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, np.ndarray] = {}
    (program,) = re.findall(r"```python\n(.*?)```", section("chart.md#the-loop-as-matrices"), re.DOTALL)
    exec(compile(program, "chart.md", "exec"), names)
    period = names["loop"].period
    system = control.ss(names["A"], names["push"][:, None], names["read"][None, :], 0)
    sampled = control.c2d(system, period)
    z = np.exp(2j * np.pi * names["frequency"] * period)
    assert names["frequency"][-1] <= 0.5 / period
    np.testing.assert_allclose([sampled(one) for one in z], names["bode"], rtol=1e-6)
    assert (tmp_path / "plant.mat").stat().st_size > 0


def test_the_five_bar_vibrates_where_the_page_on_the_chart_says():
    text = section("chart.md#when-a-device-vibrates")
    low, high = map(float, re.search(r"stable from ([\d.]+) to ([\d.]+) N s/m", text).groups())
    point = zwidth.load("five-bar").at()
    assert point.check(4000.0, [low - 0.1, low, high, high + 0.1]).names == [
        "unstable",
        "stable",
        "stable",
        "unstable",
    ]
    shown = re.findall(r"--damping (\d+) +# unstable, ([\d.]+) Hz", text)
    found = point.check(4000.0, [float(damping) for damping, _ in shown])
    assert [f"{frequency:.4g}" for frequency in found.frequency] == [frequency for _, frequency in shown]


def test_a_sine_sweep_measures_what_the_page_on_measured_devices_says():
    """The device of the fourth example, a mass on viscous friction, excited by a sweep in place of noise."""
    text = " ".join(section("measured.md#what-is-measured").split())
    shown = re.search(r"give ([\d.]+) to ([\d.]+) kN/m for .* renders ([\d.]+)\.", text).groups()
    T, mass, friction = 0.001, 0.1, 1.0
    force = 2.0 * chirp(np.arange(20_000) * T, 0.5, 20.0, 500.0)
    left = np.exp(-friction * T / mass)
    velocity = lfilter([0.0, (1.0 - left) / friction], [1.0, -left], force)
    moved = (force * T - mass * np.diff(velocity, append=0.0)) / friction
    reading = 1e-6 * np.round(lfilter([0.0, 1.0], [1.0, -1.0], moved) / 1e-6)
    response = zwidth.sweep_response(force, reading, T, integrators=2, segment=512)
    band = zwidth.chart.measured_chart(response, zwidth.Controller(T)).band
    true = zwidth.Loop(zwidth.Plant.one_mass(mass, friction), sampling_period=T).chart().stiffness_max
    computed = (band.stiffness_low, band.stiffness_high, true)
    assert tuple(f"{1e-3 * stiffness:.1f}" for stiffness in computed) == shown


def test_the_delta_of_the_page_on_device_files_has_the_masses_of_the_symmetric_motion():
    """Along z all arms turn alike: a circle round the elbow of one leg gives their rate, and so the energies."""
    text = section("device-files.md#a-delta-robot")
    (program,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    device = zwidth.from_document(tomllib.loads(program))
    point = device.at()
    base, arm, rod, height = 0.08 - 0.03, 0.08, 0.16, 0.12
    angle = point.describe().joints["arm-1"]
    out, down = base + arm * np.cos(angle), height - arm * np.sin(angle)
    assert np.hypot(out, down) == pytest.approx(rod, rel=1e-9)
    rate = down / (arm * (out * np.sin(angle) + down * np.cos(angle)))  # of the arms, for 1 m/s
    elbow = arm * rate * np.array([-np.sin(angle), np.cos(angle)])
    tip = np.array([0.0, 1.0])
    turning = np.linalg.norm(elbow - tip) / rod
    arms = (2e-5 + 0.03 * 0.04**2) * rate**2
    rods = 2 * (0.01 * np.sum(((elbow + tip) / 2) ** 2) + 2.1e-5 * turning**2)
    felt = point.effective
    assert felt.link_side_mass == pytest.approx(3 * (arms + rods) + 0.05, rel=1e-9)
    assert felt.motor_side_mass == pytest.approx(3 * 8**2 * 2e-6 * rate**2, rel=1e-9)
    assert felt.stiffness == pytest.approx(3 * 8**2 * 0.5 * rate**2, rel=1e-9)
    for shown in (
        f"{felt.link_side_mass:.4g} kg",
        f"{felt.motor_side_mass:.4g} kg",
        f"{felt.stiffness / 1e3:.4g} kN/m",
        f"{point.chart().stiffness_max / 1e3:.4g} kN/m",
    ):
        assert shown in " ".join(text.split())


def test_a_urdf_carried_over_as_the_page_says_has_the_same_mass_matrix():
    """MuJoCo reads the URDF; every frame, axis and inertia of it is turned and shifted."""
    inertia = np.array([[2e-4, 1e-5, 0.0], [1e-5, 5e-4, 2e-5], [0.0, 2e-5, 5.5e-4]])
    first = {"rpy": (0.3, -0.5, 0.8), "xyz": (0.01, 0.02, 0.03), "axis": (0.0, 0.0, 1.0), "turn": (0.0, 0.0, 0.0)}
    second = {
        "rpy": (-0.4, 0.9, 0.2),
        "xyz": (0.15, 0.02, -0.01),
        "axis": (0.0, 1.0, 0.0),
        "turn": (0.2, 0.1, -0.3),
    }
    centre, mass, angles, handle = (0.07, 0.01, 0.02), 0.2, (0.4, 1.1), (0.12, 0.0, 0.0)

    urdf = '<robot name="r"><mujoco><compiler fusestatic="false"/></mujoco><link name="base"/>'
    links = []
    for name, parent, one in (("l1", "base", first), ("l2", "l1", second)):
        moments = " ".join(f'i{"xyz"[i]}{"xyz"[j]}="{inertia[i, j]}"' for i in range(3) for j in range(i, 3))
        urdf += f"""<link name="{name}"><inertial><origin xyz="{spaced(centre)}" rpy="{spaced(one["turn"])}"/>
            <mass value="{mass}"/><inertia {moments}/></inertial></link>
            <joint name="j-{name}" type="continuous"><parent link="{parent}"/><child link="{name}"/>
            <origin xyz="{spaced(one["xyz"])}" rpy="{spaced(one["rpy"])}"/>
            <axis xyz="{spaced(one["axis"])}"/></joint>"""
        turned = Rotation.from_euler("xyz", one["turn"]).as_matrix()
        links.append(
            {
                "name": name,
                "parent": parent,
                "joint": "revolute",
                "origin_m": list(one["xyz"]),
                "orientation_rad": list(one["rpy"]),
                "axis": list(one["axis"]),
                "mass_kg": mass,
                "center_of_mass_m": list(centre),
                "inertia_kg_m2": (turned @ inertia @ turned.T).tolist(),
            }
        )
    model = mujoco.MjModel.from_xml_string(urdf + "</robot>")
    data = mujoco.MjData(model)
    data.qpos[:] = angles
    mujoco.mj_forward(model, data)
    expected = mass_matrix(model, data)
    body = model.body("l2").id
    position = data.xpos[body] + data.xmat[body].reshape(3, 3) @ handle

    joints = {"l1": angles[0], "l2": angles[1]}
    document = {
        "name": "from a URDF",
        "mechanism": {
            "links": links,
            "handle": {"link": "l2", "point_m": list(handle)},
            "assemblies": {"only": {"joints_rad": joints}},
            "reference": {"position_m": position.tolist(), "direction": [0.0, 0.0, 1.0]},
            "drives": [
                {"name": f"m-{name}", "joint": name, "motor_inertia_kg_m2": 1e-6, "transmission_ratio": 1.0}
                for name in joints
            ],
            "damping": {"mode_ratio": 0.0},
        },
        "loop": {"sampling_period_s": 0.001},
    }
    point = zwidth.from_document(document).at(joints)
    np.testing.assert_allclose(point.posture.position, position, rtol=1e-9)
    np.testing.assert_allclose(point.mass_matrix, expected, rtol=1e-9)


def spaced(numbers):
    return " ".join(map(str, numbers))
