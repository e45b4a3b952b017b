"""The page on links that bend: its code runs and gives what it says, and its tables are what comes out."""

from __future__ import annotations

import ast
import re
import tomllib
from math import cos, pi, sqrt
from pathlib import Path
from typing import Any

import pytest

import zwidth
from tests.lazy_module import LazyModule
from zwidth.model import Load

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "flexible-links.md").read_text(encoding="utf-8")
TEXT = " ".join(PAGE.split())
convergence = LazyModule("gallery.beam_convergence")
slender = LazyModule("gallery.slender_links")


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """What stands in the names after the page's code, each number beside an expression compared."""
    found: dict[str, Any] = {}
    compared = 0
    for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
        lines = block.splitlines()
        for node in ast.parse(block).body:
            said = re.search(r"# (-?[\d.]+) ", lines[node.end_lineno - 1])
            if isinstance(node, ast.Expr):
                value = eval(compile(ast.Expression(node.value), "flexible-links.md", "eval"), found)
                assert said is not None
                assert f"{float(value):.6g}" == said[1]
                compared += 1
            else:
                exec(compile(ast.Module([node], []), "flexible-links.md", "exec"), found)
    assert compared == 15
    return found


def test_a_load_adds_what_the_text_says(names):
    for device, said in (
        (names["bent"], "raise its largest stiffness by {} %"),
        (names["rigid"], "by {} % with rigid"),
    ):
        loaded = device.at(load=Load(push=-5.0)).chart(decay=False).stiffness_max
        change = 100.0 * (loaded / device.at().chart(decay=False).stiffness_max - 1.0)
        assert said.format(f"{change:.3f}") in TEXT


def test_two_masses_vibrate_and_are_felt_as_the_text_says(names):
    m, motor, T = names["m"], names["motor"], names["T"]
    for k, place in ((15620.0, "{} N/m of the first"), (10383.0, "{} N/m of the second")):
        frequency = sqrt(k * (1.0 / m + 1.0 / motor)) / (2.0 * pi)
        assert f"{cos(2.0 * pi * frequency * T):.2f}" in TEXT
        assert f"at {frequency:.0f} Hz" in TEXT
        K = names["largest"](k)
        assert place.format(f"{K * k / (K + k):.0f}") in TEXT


def test_the_links_of_the_page_make_an_arm_that_weighs_what_it_says():
    """In place of those of the first example of the page on device files that has the same names."""
    (fragment,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    files = (DOCS / "device-files.md").read_text(encoding="utf-8")
    examples = [
        tomllib.loads(text) for text in re.findall(r"^```toml\n(name.*?)^```", files, re.MULTILINE | re.DOTALL)
    ]
    links = tomllib.loads(fragment)["mechanism"]["links"]
    by_names = {tuple(each["name"] for each in one.get("mechanism", {}).get("links", ())): one for one in examples}
    document = by_names[tuple(link["name"] for link in links)]
    document["mechanism"]["links"] = links
    point = zwidth.from_document(document).at()
    upper, lower = point.describe().beams
    assert f"nothing else: {1e3 * upper.mass:.2f} g" in TEXT
    assert f"the tube makes {1e3 * lower.mass:.3f} g" in TEXT
    assert lower.mass + lower.carried_mass == pytest.approx(links[1]["mass_kg"])
    assert point.chart(decay=False).stiffness_max > 1000.0


def test_errors_fall_as_the_table_says():
    for row in convergence.rows():
        assert row in PAGE, row


def test_slender_links_do_what_the_tables_say():
    for row in [*slender.rows(), *slender.damping_rows()]:
        assert row in PAGE, row


def test_a_lump_misses_what_the_text_says():
    shares = {}
    for tubes in list(slender.TUBES)[:4]:
        found = slender.numbers(tubes)
        rigid, modes, lump = (found[key].stiffness_max for key in (slender.RIGID, "assumed modes", "lumped tips"))
        shares[tubes] = (modes - lump) / (modes - rigid)
    distal, soft, thick, thin = shares.values()
    assert (
        f"misses {100.0 * thin:.0f} % and {100.0 * thick:.0f} % of the change with tubes as driven links" in TEXT
    )
    assert (round(3.0 * distal), round(3.0 * soft)) == (1, 2)


@pytest.mark.parametrize("tubes", ["distal, 8 x 0.5 mm", "driven, 12 x 1 mm"])
@pytest.mark.filterwarnings("ignore::zwidth.device.plausibility.ImplausibleNumber")
def test_two_modes_are_enough(tubes):
    device = slender.with_tubes(tubes, "assumed modes")
    more = device.with_({f"links.{name}.beam.modes": 8 for name in slender.TUBES[tubes][0]})
    found = [each.at().chart(decay=False).stiffness_max for each in (device, more)]
    assert found[0] == pytest.approx(found[1], rel=1e-7)
