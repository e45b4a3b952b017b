"""`zwidth sensitivity`: what to change first."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver, table
from zwidth.show.cli.computing import NoAnswer, computing
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Question, about_a_device, as_json, example, output_option
from zwidth.show.cli.place import heading
from zwidth.show.output import DATA, FIGURES, destination, replacing, write_data
from zwidth.show.units import amount, given, signed, typed

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.study.sensitivity import Sensitivities, Sensitivity

NO_WALL: Final = "no stable wall has K > 0 and B >= 0, so that there is no largest stiffness to change"
KEYS: Final = (
    "sensitivities",
    "groups",
    "left_out",
    "stiffness_max_N_per_m",
    "damping_at_stiffness_max_Ns_per_m",
    "held_by",
    "rival_stiffness_N_per_m",
    "one_sided",
)


@click.command(
    short_help="Find what of DEVICE to change first.",
    epilog=example(
        "zwidth sensitivity my-device.toml --top 5",
        "zwidth sensitivity my-device.toml --set loop.delay_samples=1 --output bars.svg",
    ),
)
@about_a_device
@click.option("--top", metavar="N", type=click.IntRange(min=1), default=12, help="Rows for people (default 12).")
@output_option("Write a figure (.png .svg .pdf) or the data (.csv .json).")
@as_json
def sensitivity(question: Question, top: int, output: str | None, as_json: bool) -> int:
    """Find what of DEVICE to change first: how the largest stiffness answers to each of its numbers."""
    path = None if output is None else destination(output, FIGURES + DATA)
    device = question.device()
    if device.response is not None:
        return without_model(question, device, dict.fromkeys(KEYS) | {"decided": True}, as_json)
    try:
        with computing(question):
            found = _computed(question, device)
    except NoAnswer as none:
        unanswered = question.facts(device) | dict.fromkeys(KEYS) | {"decided": none.decided}
        return deliver(Answer(unanswered, reason=str(none)), as_json)
    document = question.facts(device) | numbers(found) | {"decided": True}
    reason = None if found.peak is not None else NO_WALL
    if path is not None:
        document["file"] = str(path)
        _write(path, found, document, reason, top)
    return deliver(Answer(document, lambda: list(_pages(question, device, found, top, path)), reason), as_json)


def _computed(question: Question, device: Device) -> Sensitivities:
    from zwidth.study.sensitivity import sensitivities

    return sensitivities(device, question.point(device))


def numbers(found: Sensitivities) -> dict[str, Any]:
    """The sensitivities under the keys of --json."""
    peak = found.peak
    return {
        "sensitivities": [_entry(found, number) for number in found.numbers],
        "groups": [
            {
                "path": group.path,
                "members": group.members,
                "d_ln_stiffness_max_d_ln_value": group.logarithmic,
            }
            for group in found.groups
        ],
        "left_out": [{"path": path, "reason": reason} for path, reason in found.left_out.items()],
        "stiffness_max_N_per_m": None if peak is None else peak.stiffness,
        "damping_at_stiffness_max_Ns_per_m": None if peak is None else peak.damping,
        "held_by": found.kind,
        "rival_stiffness_N_per_m": found.rival,
        "one_sided": found.tie,
    }


def _entry(found: Sensitivities, number: Sensitivity) -> dict[str, Any]:
    assert found.peak is not None
    return {
        "path": number.path,
        "value": number.value,
        "unit": number.unit or None,
        "d_ln_stiffness_max_d_ln_value": number.logarithmic,
        "d_stiffness_max_d_value_N_per_m": number.derivative,
        "one_percent_gives_N_per_m": 0.01 * number.logarithmic * found.peak.stiffness,
        "error": number.error,
        "side": number.side or None,
        "reason": number.reason or None,
    }


def _pages(question: Question, device: Device, found: Sensitivities, top: int, path: Path | None) -> Iterator[Any]:
    yield heading(question, device)
    if found.peak is not None:
        yield (
            f"largest stiffness {amount(found.peak.stiffness, 'N/m')} at "
            f"{amount(found.peak.damping, 'Ns/m')} of damping; held by: {found.kind or 'not known'}"
        )
        told = [number for number in found.numbers if number.logarithmic == number.logarithmic]
        shown = [number for number in told if number.logarithmic != 0.0][:top]
        yield table(["number", "value", "sensitivity", "+1 % gives"], [_row(found, number) for number in shown])
        yield from _remarks(found, len(told) - len(shown))
    if path is not None:
        yield f"written: {path}"


def _row(found: Sensitivities, number: Sensitivity) -> tuple[str, str, str, str]:
    assert found.peak is not None
    gain = 0.01 * number.logarithmic * found.peak.stiffness
    return (
        number.path,
        f"{typed(given(number.value))} {number.unit}".rstrip(),
        typed(signed(number.logarithmic)),
        f"{'+' if gain > 0.0 else ''}{amount(gain, 'N/m')}",
    )


def _remarks(found: Sensitivities, more: int) -> Iterator[str]:
    """What the table does not show."""
    late = next((n for n in found.numbers if n.path == "loop.delay_samples" and n.value == 0.0), None)
    if late is not None and late.derivative == late.derivative:
        yield f"a delay of 0.01 samples gives {amount(0.01 * late.derivative, 'N/m')}"
    if found.tie:
        yield "two walls are stiffest at once: these numbers are of one of them, and a change may lower the other"
    elif found.peak is not None and found.rival > 0.9 * found.peak.stiffness:
        yield f"another summit stands at {amount(found.rival, 'N/m')}: it takes over once this one falls below it"
    if more > 0:
        yield f"and {more} more that matter less or not at all; --top N, --json or --output holds them"


def _write(path: Path, found: Sensitivities, document: dict[str, Any], reason: str | None, top: int) -> None:
    if path.suffix.lower() in DATA:
        rows = document["sensitivities"]
        keys = ("path", "value", "unit", "d_ln_stiffness_max_d_ln_value", "d_stiffness_max_d_value_N_per_m")
        columns = (*keys, "one_percent_gives_N_per_m", "error", "side", "reason")
        table_ = {key: [row[key] for row in rows] for key in columns}
        write_data(path, document | ({} if reason is None else {"reason": reason}), table_)
        return
    from zwidth.show.figures.sensitivity import draw_sensitivities
    from zwidth.show.figures.style import figure, save

    drawing, ax = figure(6.2, 0.9 + 0.27 * max(min(top, len(found.numbers)), 3))
    draw_sensitivities(ax, found, top)
    with replacing(path) as draft:
        save(drawing, draft)
