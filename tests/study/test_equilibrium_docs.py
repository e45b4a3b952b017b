"""The page on loads: its code runs and gives what it says, and its tables are what devices give."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import zwidth
from zwidth.chart import largest_stiffness
from zwidth.measures import fastest_sideways_motion
from zwidth.model import Load

PAGE = (Path(__file__).parents[2] / "docs" / "equilibrium.md").read_text(encoding="utf-8")
TEXT = " ".join(PAGE.split())
OPERATORS_PAGE = (Path(__file__).parents[2] / "docs" / "operators.md").read_text(encoding="utf-8")
OPERATORS = " ".join(OPERATORS_PAGE.split())
DOWN = (0.0, 0.0, -9.81)
NEGLECTED = (
    ("five-bar", (0.0, 1.0), Load(push=-5.0)),
    ("five-bar", (0.0, 1.0), Load(push=5.0)),
    ("five-bar", (1.0, 0.0), Load(push=-5.0)),
    ("phantom-premium-1.5", None, Load(push=-5.0, gravity=DOWN)),
    ("stamper-delta", None, Load(push=-5.0, gravity=DOWN)),
)


def share(value: float) -> str:
    """A relative change in per cent, two digits."""
    text = f"{100.0 * value:+.2g}"
    return f"{float(text):+.10f}".rstrip("0").rstrip(".").replace("-", "−") + " %"


def rate(motion: Any) -> str:
    text = f"{float(f'{motion.growth_rate:.4g}'):.10f}".rstrip("0").rstrip(".")
    return text.replace("-", "−")


def neglected_row(name: str, direction: Any, load: Load) -> str:
    point = zwidth.load(name).at(direction=direction, load=load)
    without = replace(point, load=replace(load, hand="neglected"))
    K, K_without = (largest_stiffness(one.loop).stiffness for one in (point, without))
    change = float(point.measure("load_change"))
    where = "" if direction is None else " along y" if direction[1] else " along x"
    under = f"{load.push:g} N".replace("-", "−") + (", gravity" if load.gravity is not None else "")
    rates = [rate(fastest_sideways_motion(one)) for one in (point, without)]
    return (
        f"| `{name}`{where} | {under} | {share(change)} | {share(K_without / K - 1.0)} | {rates[0]} | {rates[1]} |"
    )


@pytest.mark.parametrize(("name", "direction", "load"), NEGLECTED)
def test_what_is_neglected_is_worth_what_the_table_says(name, direction, load):
    row = neglected_row(name, direction, load)
    assert row in PAGE, row


def surface_rows() -> list[str]:
    path = zwidth.load("five-bar").load_path(10.0, 5)
    return [
        f"| {step.push:g} N | {step.stiffness_max:.1f} N/m | {step.fixed_surface:.1f} N/m | "
        f"{1e3 * abs(step.push) / step.fixed_surface:.2f} mm |".replace("| -", "| −")
        for step in path.steps
        if step.push
    ]


def test_a_fixed_surface_gives_what_the_table_says():
    for row in surface_rows():
        assert row in PAGE, row


def test_the_code_of_the_page_gives_its_numbers():
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict[str, Any] = {}
    lines, compared = block.splitlines(), 0
    for node in ast.parse(block).body:
        said = re.search(r"# (-?[\d.]+) ", lines[node.end_lineno - 1])
        if isinstance(node, ast.Expr):
            value = eval(compile(ast.Expression(node.value), "equilibrium.md", "eval"), names)
            assert said is not None
            assert f"{value:.6g}" == said[1]
            compared += 1
        else:
            exec(compile(ast.Module([node], []), "equilibrium.md", "exec"), names)
    assert compared == 5


def test_the_numbers_in_the_text_are_what_comes_out():
    device = zwidth.load("five-bar")
    found = device.at(load=Load(push=-5.0)).equilibrium
    assert f"{1e3 * abs(found.sideways_force[0]):.0f} mN for 5 N on the five-bar" in TEXT
    K = device.at(load=Load(push=-5.0)).chart(decay=False).stiffness_max
    assert f"{1e3 * found.one_sided_amplitude(K):.2f} mm of the five-bar under 5 N" in TEXT
    counted = device.at(load=Load(push=-5.0, count_sideways=True)).chart(decay=False)
    assert counted.regions == ()
    assert "on the five-bar under 5 N then no wall is stable at all" in TEXT
    growth = device.at(load=Load(push=-5.0)).loop.sideways_motions[0].growth_rate
    assert f"one root at {1.0 + growth * device.controller.sampling_period:.4f} would" in TEXT
    pulled = device.at(load=Load(push=5.0))
    wrong = replace(pulled, load=replace(pulled.load, hand="neglected"))
    rates = [fastest_sideways_motion(one).growth_rate for one in (wrong, pulled)]
    assert f"slide away at {rates[0]:.4g} 1/s, and does so at {rates[1]:.4g} 1/s" in TEXT


def test_what_compensates_gravity_is_worth_what_the_text_says():
    rates = [
        zwidth.load("five-bar", {"mechanism.gravity_compensation": kind})
        .at((0.05, 0.2), gravity=(0.0, -9.81))
        .loop.sideways_motions[0]
        .growth_rate
        for kind in ("none", "computed", "counterweight")
    ]
    assert f"slides away from under the hand at {rates[0]:.1f} 1/s" in TEXT
    assert f"nothing of that is left but {rates[1]:.4f} 1/s" in TEXT
    assert rates[2] == 0.0


def test_a_hand_that_holds_every_direction_stops_what_grows():
    rendered = zwidth.load("five-bar", operator="thesis-arm")
    held = rendered.with_({"operator.directions": "all"}).at(load=Load(push=-5.0))
    assert held.loop.sideways_motions == ()
    found = [one.chart(decay=False).stiffness_max for one in (held, rendered.at(load=Load(push=-5.0)))]
    assert f"then renders up to {found[0]:.2f} N/m, where it is {found[1]:.2f} N/m with a hand on" in OPERATORS


def test_the_arm_of_the_page_on_operators_holds_the_five_bar(tmp_path):
    (example,) = re.findall(r"```toml\n(\[arm\].*?)```", OPERATORS_PAGE, re.DOTALL)
    file = tmp_path / "arm.toml"
    file.write_text(example)
    device = zwidth.load("five-bar", operator=file)
    assert device.operator_name == "seated"
    found = [one.chart(decay=False).stiffness_max for one in (device.at(), device.at(load=Load(push=-5.0)))]
    assert f"renders up to {found[0]:.2f} N/m, under 5 N {found[1]:.2f} N/m" in OPERATORS


if __name__ == "__main__":  # the rows for the page
    print("\n".join([*(neglected_row(*case) for case in NEGLECTED), *surface_rows()]))
