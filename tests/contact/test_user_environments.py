"""A user's own environment: parameters are checked, files are found, and faults are said in one sentence."""

import pickle
import re
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from zwidth.compiled import compiled
from zwidth.contact import ENVIRONMENTS, Environment, Parameter, load_environment
from zwidth.contact.environments import environment
from zwidth.contact.environments.environment import environment_at

HEAD = "from zwidth.contact.environments import Parameter, environment\n"
GOOD = HEAD + (
    "@environment([Parameter('level', 'N', 0.5, low=0.0, high=3.0), Parameter('rate', '1/s')])\n"
    "def push(x, v, t, T, p, m):\n"
    "    'Pushes out.'\n"
    "    m[0] += 1.0\n"
    "    return -p[0] * m[0] - p[1] * t\n"
)


@compiled
def sum_of_forces(address, positions, parameters):
    """Sum of forces, as a kernel sees environments."""
    force, memory, total = environment_at(address), np.zeros(8), 0.0
    for x in positions:
        total += force(x, 0.0, 0.0, 1e-3, parameters, memory)
    return total


@pytest.fixture
def write_environment(tmp_path):
    def write(text):
        file = tmp_path / "own.py"
        file.write_text(text)
        return f"{file}:push"

    return write


def test_one_kernel_calls_all_environments_and_is_compiled_once():
    x = np.linspace(-1e-3, 1e-3, 11)
    for each in ENVIRONMENTS.values():
        memory = np.zeros(8)
        expected = sum(each.force(a, 0.0, 0.0, 1e-3, each.values(), memory) for a in x)
        assert sum_of_forces(each.address, x, each.values()) == pytest.approx(expected, abs=1e-15)
    assert len(sum_of_forces.signatures) == 1


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_compiled_and_python_agree(name):
    each, rng = ENVIRONMENTS[name], np.random.default_rng(0)
    slow, fast, values = np.zeros(8), np.zeros(8), each.values()
    for x, v in zip(rng.normal(0, 2e-3, 200), rng.normal(size=200), strict=True):
        expected = each.function(x, v, 0.0, 1e-3, values, slow)
        assert each.force(x, v, 0.0, 1e-3, values, fast) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_an_own_environment_is_loaded_and_run(write_environment):
    mine = load_environment(write_environment(GOOD))
    assert (mine.name, mine.description, mine.names) == ("push", "Pushes out.", ("level", "rate"))
    assert sum_of_forces(mine.address, np.zeros(3), mine.values(rate=0.0)) == pytest.approx(-0.5 * (1 + 2 + 3))


def test_an_edit_of_the_file_counts_at_once(write_environment):
    parameters = np.array([1.0, 0.0])
    written = load_environment(write_environment(GOOD))
    assert sum_of_forces(written.address, np.zeros(1), parameters) == -1.0
    changed = GOOD.replace("-p[0] * m[0]", "-10.0 * p[0] * m[0]")
    assert sum_of_forces(load_environment(write_environment(changed)).address, np.zeros(1), parameters) == -10.0


@pytest.mark.parametrize("source", [None, "slot"])
def test_environments_go_to_other_processes(write_environment, source):
    each = load_environment(source or write_environment(GOOD))
    again = pickle.loads(pickle.dumps(each))
    assert (again.name, again.names) == (each.name, each.names)


def test_one_made_without_a_file_works_but_stays_where_it_is():
    scope = {"environment": environment}
    exec("@environment()\ndef still(x, v, t, T, p, m):\n    return 0.25", scope)
    assert sum_of_forces(scope["still"].address, np.zeros(2), np.zeros(0)) == 0.5
    with pytest.raises(TypeError, match=r"^still "):
        pickle.dumps(scope["still"])


def test_nothing_is_compiled_at_import():
    program = (
        "from zwidth.contact.environments import ENVIRONMENTS\n"
        "print(sum('force' in vars(each) for each in ENVIRONMENTS.values()), len(ENVIRONMENTS))"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == ["0", str(len(ENVIRONMENTS))]


def test_values_come_in_order_and_with_defaults():
    np.testing.assert_array_equal(ENVIRONMENTS["slot"].values(damping=2, no_pull=True), [5e-3, 1000.0, 2.0, 1.0])


def test_the_documented_one_gives_way_once(tmp_path):
    page = Path(__file__).parents[2] / "docs" / "environments.md"
    (text,) = re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    (tmp_path / "my_walls.py").write_text(text)
    button, memory = load_environment(f"{tmp_path / 'my_walls.py'}:button"), np.zeros(8)
    forces = [button.force(x, 0.0, 0.0, 1e-3, button.values(), memory) for x in (5e-4, 2e-3, 5e-4, -1e-3, 5e-4)]
    np.testing.assert_allclose(forces, [-1.0, -0.8, -0.2, 0.0, -1.0])


def test_every_environment_is_documented_with_its_parameters():
    page = (Path(__file__).parents[2] / "docs" / "environments.md").read_text(encoding="utf-8")
    for name, each in ENVIRONMENTS.items():
        assert f"| `{name}` |" in page
        assert all(f"`{parameter}`" in page for parameter in each.names)
        assert each.description
        assert each.__doc__ == each.function.__doc__


def test_an_environment_is_what_the_decorator_makes():
    @environment([Parameter("level", "N", 1.0)], name="lift")
    def push(x, v, t, T, p, m):
        return p[0]

    assert isinstance(push, Environment)
    assert push.name == "lift"
    assert push.force.signatures[0][4] == numba.float64[::1]
