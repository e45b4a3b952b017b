"""`zwidth bounds`: what published conditions say, beside the exact answer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver, sheet, table
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.heading import heading
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Finite, Question, about_a_device, as_json, example, output_option
from zwidth.show.output import DATA, FIGURES, destination, replacing, write_data
from zwidth.show.units import amount, number, typed

if TYPE_CHECKING:
    from zwidth.chart.chart import StabilityChart
    from zwidth.conditions import Bound
    from zwidth.device.device import Device

KEYS: Final = (
    "bounds",
    "damping_Ns_per_m",
    "exact_N_per_m",
    "exact_largest_N_per_m",
    "exact_damping_at_largest_Ns_per_m",
)
# What a condition lacks, for people.
LACKED: Final = {
    "rigid_mass_kg": "a free mass",
    "damping_Ns_per_m": "friction of a free mass",
    "motor_side_mass_kg": "a motor side",
    "stiffness_N_per_m": "a spring behind it",
    "mode_mass_kg": "a single motion",
    "mode_damping_Ns_per_m": "a single motion's friction",
    "mode_stiffness_N_per_m": "a single motion's spring",
    "time_constant_s": "a first-order filter",
    "electrical_damping_Ns_per_m": "electrical damping",
    "coulomb_friction_N": "dry friction",
    "resolution_m": "the encoder's step",
}


@dataclass(frozen=True)
class Found:
    """The conditions on one loop, at one damping.

    chart     the exact answer; None where it could not be drawn, `undrawn` says why
    damping   B of the comparison [N s/m]
    exact     largest stable stiffness there [N/m]; nan without a chart
    """

    bounds: list[Bound]
    chart: StabilityChart | None
    undrawn: str
    damping: float
    exact: float

    @property
    def largest(self) -> float:
        """Largest stable stiffness of all [N/m]; nan without a chart, 0 if no wall is stable."""
        if self.chart is None:
            return float("nan")
        return self.chart.stiffness_max if self.chart.stiffness_max > 0.0 else 0.0


@click.command(
    short_help="Compare published conditions on DEVICE with the exact answer.",
    epilog=example(
        "zwidth bounds my-device.toml",
        "zwidth bounds my-device.toml --damping 2 --output bounds.csv",
    ),
)
@about_a_device
@click.option(
    "--damping",
    metavar="B",
    type=Finite(),
    help="Damping of the walls compared [Ns/m]. Default: that of the stiffest stable wall; 0 if there is none.",
)
@output_option("Write a figure (.png .svg .pdf) or the data (.csv .json).")
@as_json
def bounds(question: Question, damping: float | None, output: str | None, as_json: bool) -> int:
    """Compare published conditions on DEVICE with the exact answer, and say which assumptions it does not meet."""
    path = None if output is None else destination(output, FIGURES + DATA)
    device = question.device()
    if device.response is not None:
        return without_model(question, device, dict.fromkeys(KEYS) | {"decided": True}, as_json)
    try:
        with computing(question):
            found = _compared(question, device, damping)
    except NoAnswer as none:
        unanswered = question.facts(device) | dict.fromkeys(KEYS) | {"decided": none.decided}
        return deliver(Answer(unanswered, reason=str(none)), as_json)
    document = question.facts(device) | numbers(found)
    if path is not None:
        document["file"] = str(path)
        _write(path, found, document)
    return deliver(Answer(document, lambda: list(_pages(question, device, found, path))), as_json)


def _compared(question: Question, device: Device, damping: float | None) -> Found:
    from zwidth.chart.arc_joining import ChartError
    from zwidth.chart.chart import stability_chart
    from zwidth.conditions import compare
    from zwidth.conditions.exact import stiffness_limit
    from zwidth.show.friction import told_of

    point = question.point(device)
    loop = point.loop
    chart, undrawn = None, ""
    try:
        chart = stability_chart(loop, decay=False)
    except ChartError as error:
        undrawn = str(error)
    if damping is None:
        known = chart is not None and chart.stiffness_max > 0.0
        damping = chart.damping_at_stiffness_max if chart is not None and known else 0.0
    exact = stiffness_limit(chart, damping) if chart is not None else float("nan")
    told = compare(loop, wall_damping=damping, **told_of(point))
    return Found(told, chart, undrawn, damping, exact)


def numbers(found: Found) -> dict[str, Any]:
    """The comparison under the keys of --json."""
    chart = found.chart
    told = {} if chart is not None else {"undecided": found.undrawn}
    return {
        "bounds": [_entry(found, bound) for bound in found.bounds],
        "damping_Ns_per_m": found.damping,
        "exact_N_per_m": found.exact,
        "exact_largest_N_per_m": found.largest,
        "exact_damping_at_largest_Ns_per_m": None if chart is None else chart.damping_at_stiffness_max,
        "decided": chart is not None,
        **told,
    }


def _entry(found: Found, bound: Bound) -> dict[str, Any]:
    there = float(bound.stiffness_max_at(found.damping))
    return {
        "name": bound.name,
        "source": bound.source,
        "kind": bound.kind,
        "claim": bound.claim,
        "statement": bound.statement,
        "stiffness_max_N_per_m": there,
        "ratio_to_exact": _ratio(there, found.exact),
        "largest_N_per_m": bound.stiffness_max,
        "damping_at_largest_Ns_per_m": bound.damping_at_stiffness_max,
        "largest_ratio_to_exact": _ratio(bound.stiffness_max, found.largest),
        "assumptions": list(bound.assumptions),
        "violated": list(bound.violated),
        "taken": dict(bound.taken),
        "lacking": list(bound.lacking),
    }


def _ratio(told: float, exact: float) -> float | None:
    return told / exact if exact > 0.0 else None


def _pages(question: Question, device: Device, found: Found, path: Path | None) -> Iterator[Any]:
    yield heading(question, device)
    yield sheet(list(_exact(found)))
    speaking = [bound for bound in found.bounds if not bound.lacking]
    # the assumptions not met, in the order in which they come up, numbered from 1
    unmet = list(dict.fromkeys(sentence for bound in speaking for sentence in bound.violated))
    headings = ["condition", "claims", f"at {amount(found.damping, 'Ns/m')}", "of exact", "largest", "not met"]
    yield table(headings, [_row(found, bound, unmet) for bound in speaking])
    if unmet:
        yield "not met here:"
        yield sheet([(f"{n}", sentence) for n, sentence in enumerate(unmet, start=1)])
    silent = [(bound.name, _needs(bound)) for bound in found.bounds if bound.lacking]
    if silent:
        yield "not asked, for the device lacks what they take:"
        yield sheet(silent)
    if path is not None:
        yield f"written: {path}"


def _exact(found: Found) -> Iterator[tuple[str, str]]:
    chart = found.chart
    if chart is None:
        yield "exact", f"undecided: {found.undrawn}"
        return
    yield f"exact, at {amount(found.damping, 'Ns/m')}", _stiffness(found.exact)
    if chart.stiffness_max > 0.0:
        yield "exact, largest", f"{_stiffness(found.largest)} at {amount(chart.damping_at_stiffness_max, 'Ns/m')}"
    else:
        yield "exact, largest", "none"


def _row(found: Found, bound: Bound, unmet: list[str]) -> tuple[str, ...]:
    there = float(bound.stiffness_max_at(found.damping))
    ratio = _ratio(there, found.exact)
    return (
        bound.name,
        f"{bound.kind}, {bound.claim}",
        _stiffness(there),
        "-" if ratio is None or ratio != ratio else typed(number(ratio)),
        _stiffness(bound.stiffness_max),
        " ".join(str(unmet.index(sentence) + 1) for sentence in bound.violated) or "-",
    )


def _stiffness(value: float) -> str:
    """A largest stiffness, no more than there is; "-" where nothing is said, "none" where none is admitted."""
    if value != value:
        return "-"
    return amount(value, "N/m") if value > 0.0 else "none"


def _needs(bound: Bound) -> str:
    return ", ".join(LACKED.get(name, name) for name in bound.lacking)


def _write(path: Path, found: Found, document: dict[str, Any]) -> None:
    if path.suffix.lower() in DATA:
        columns = [key for key in document["bounds"][0] if key not in ("assumptions", "taken")]
        rows = {key: [_cell(entry[key]) for entry in document["bounds"]] for key in columns}
        write_data(path, document, rows)
        return
    from zwidth.show.figures.bounds import draw_bounds
    from zwidth.show.figures.style import figure, save

    drawing, ax = figure(height=4.6)
    draw_bounds(ax, found.bounds, found.chart)
    with replacing(path) as draft:
        save(drawing, draft)


def _cell(value: Any) -> Any:
    """A list as one cell, its sentences one after another."""
    return " ".join(value) if isinstance(value, list) else value
