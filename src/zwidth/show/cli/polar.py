"""`zwidth polar`: how stiff a wall can be along each direction."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver, sheet
from zwidth.show.cli.computing import NoAnswer, computing
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Question, about_a_device, as_json, example, output_option
from zwidth.show.cli.place import heading
from zwidth.show.output import DATA, FIGURES, destination, replacing, shown, write_data
from zwidth.show.units import amount, given, typed, vector

if TYPE_CHECKING:
    from zwidth.chart.polar import ByDirection
    from zwidth.device.device import Device

AXES: Final = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
KEYS: Final = (
    "directions",
    "angle_deg",
    "stiffness_max_N_per_m",
    "damping_at_stiffness_max_Ns_per_m",
    "frequency_at_stiffness_max_Hz",
    "status",
)
NONE_STABLE: Final = "no direction has a stable wall with K > 0 and B >= 0"


@click.command(
    short_help="Find the largest stiffness along every direction.",
    epilog=example(
        "zwidth polar my-device.toml --at 0.1,0.2 --output polar.svg",
        "zwidth polar my-device.toml --plane xz --count 36 --json",
    ),
)
@about_a_device
@click.option(
    "--plane",
    type=click.Choice(tuple(AXES)),
    help="Plane of the directions. Default: xy, or where the handle cannot move all over it, one where it can.",
)
@click.option(
    "--count",
    metavar="N",
    type=click.IntRange(3, 3600),
    default=72,
    show_default=True,
    help="Number of directions, spread evenly over the full turn.",
)
@output_option("Write a figure (.png .svg .pdf) or the data (.csv .json).")
@as_json
def polar(question: Question, plane: str | None, count: int, output: str | None, as_json: bool) -> int:
    """Find the largest stiffness that DEVICE renders stably along every direction of a plane."""
    path = None if output is None else destination(output, FIGURES + DATA)
    if question.direction is not None:
        raise BadInput("--direction: does not apply to all directions of a plane; leave it out, or use --plane")
    device = question.device()
    if device.mechanism is None:
        raise BadInput(f"{question.name}: has no [mechanism], and so one direction only; ask for its chart")
    question.of_several_directions(device)
    try:
        with computing(question):
            plane, found = _computed(question, device, plane, count)
    except NoAnswer as none:
        unanswered = _facts(question, device) | {"plane": plane} | dict.fromkeys(KEYS)
        return deliver(Answer(unanswered, reason=str(none)), as_json)
    answer = _answer(question, device, plane, found, path)
    if path is not None:
        _write(path, plane, found, answer)
    return deliver(answer, as_json)


def _heading(question: Question, device: Device) -> str:
    """Which device, where, sampled how; no direction is meant more than another."""
    facts = question.facts(device)
    _, rest = heading(question, device).split("\n", 1)
    where = f"at {vector(facts['position_m'], 'm')}, assembly {facts['assembly']}, model {facts['model']}"
    return f"{shown(device.name)}: {where}\n{rest}"


def _facts(question: Question, device: Device) -> dict[str, Any]:
    return {key: value for key, value in question.facts(device).items() if key != "direction"}


def _computed(question: Question, device: Device, plane: str | None, count: int) -> tuple[str, ByDirection]:
    import numpy as np

    from zwidth.chart.polar import circle, largest_stiffness_by_direction

    point = question.point(device)
    chosen = plane or _movable(point.jacobian)
    first, second = np.eye(3)[list(AXES[chosen])]
    directions = circle(count, first, second)
    return chosen, largest_stiffness_by_direction(point, directions)


def _movable(jacobian: Any) -> str:
    """The first plane in all of whose directions the handle can move; xy where there is none."""
    import numpy as np

    whole = np.linalg.norm(jacobian, 2)
    for plane, axes in AXES.items():
        rows = jacobian[list(axes)]
        if min(rows.shape) == 2 and np.linalg.svd(rows, compute_uv=False)[-1] > 1e-9 * whole:
            return plane
    return "xy"


def _angles(found: ByDirection) -> Any:
    import numpy as np

    return 360.0 * np.arange(len(found.stiffness)) / len(found.stiffness)


def _answer(question: Question, device: Device, plane: str, found: ByDirection, path: Path | None) -> Answer:
    import numpy as np

    values = (
        found.directions,
        _angles(found),
        found.stiffness,
        found.damping,
        found.frequency,
        list(found.status),
    )
    document = _facts(question, device) | {"plane": plane} | dict(zip(KEYS, values, strict=True))
    if path is not None:
        document["file"] = str(path)

    def pages() -> Iterator[Any]:
        yield _heading(question, device)
        yield sheet(list(_rows(found, plane)))
        if path is not None:
            yield f"written: {path}"

    reason = None if np.isfinite(found.stiffness).any() else _why(found)
    return Answer(document, lambda: list(pages()), reason)


def _why(found: ByDirection) -> str:
    """Why no direction has an answer: the reason they share, or all of them."""
    from zwidth.chart.polar import NO_WALL

    reasons = sorted(set(found.status))
    return NONE_STABLE if reasons == [NO_WALL] else "; ".join(reasons)


def _rows(found: ByDirection, plane: str) -> Iterator[tuple[str, str]]:
    import numpy as np

    count = len(found.stiffness)
    have = np.isfinite(found.stiffness)
    yield "directions", f"{count} of the {plane} plane"
    if have.any():
        angles = _angles(found)
        for name, k in (
            ("stiffest", int(np.nanargmax(found.stiffness))),
            ("least stiff", int(np.nanargmin(found.stiffness))),
        ):
            yield (
                name,
                f"{amount(found.stiffness[k], 'N/m')} at {amount(found.damping[k], 'Ns/m')} of damping, "
                f"along {typed(given(float(angles[k])))}° from {plane[0]} towards {plane[1]}",
            )
    for status in sorted({status for status, answered in zip(found.status, have, strict=True) if not answered}):
        yield "without answer", f"{found.status.count(status)}: {status}"


def _write(path: Path, plane: str, found: ByDirection, answer: Answer) -> None:
    if path.suffix.lower() in DATA:
        reason = {} if answer.reason is None else {"reason": answer.reason}
        table = {f"direction_{axis}": found.directions[:, k] for k, axis in enumerate("xyz")}
        columns = table | {key: answer.document[key] for key in KEYS[1:]}
        write_data(path, answer.document | reason, columns)
        return
    from zwidth.show.figures.polar import draw_polar
    from zwidth.show.figures.style import figure, save

    drawing, ax = figure(4.6, 5.2)
    draw_polar(ax, found, _angles(found), (plane[0], plane[1]))
    with replacing(path) as draft:
        save(drawing, draft)
