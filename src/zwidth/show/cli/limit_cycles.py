"""`zwidth limit-cycles`: which vibrations keep themselves up on a wall?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver, sheet, table
from zwidth.show.cli.contact_options import Bounded
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.heading import heading
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Finite, Question, about_a_device, as_json, example, named, output_option
from zwidth.show.cli.predicted_cycles import (
    NOT_PREDICTED,
    Met,
    Predicted,
    acting,
    columns,
    cycle_speed,
    numbers,
    predicted,
)
from zwidth.show.cli.progress import progress_told
from zwidth.show.output import DATA, FIGURES, destination, write_data
from zwidth.show.units import amount, given

if TYPE_CHECKING:
    from zwidth.contact.limit_cycles import LimitCycle
    from zwidth.contact.plane import DevicePlane
    from zwidth.device.device import Device
    from zwidth.loop.loop import Loop

KEYS: Final = (
    "verdict",
    "nonlinear",
    "predicted_by",
    "limit_cycles",
    "otherwise",
    "largest_motion_m",
    "leaves_range",
    "resting_limit_N_per_m",
    "quiet_limit_N_per_m",
    "growth",
)
FRICTION: Final = ("friction.coulomb_N", "mechanism.drives.*.coulomb_Nm")  # of a [plant], of a [mechanism]
STEPS: Final = ("loop.encoder.resolution_m", "mechanism.drives.*.encoder_counts_per_rev")
NOTHING: Final = (
    "nothing in this device depends on the amplitude, so that no vibration keeps its size; give it dry "
    "friction ({}), encoder steps ({}) or a largest force (loop.saturation.force_N), in the file or by --set"
)
OTHERWISE: Final = 1.5  # ratio of frequencies from which a simulation does not have the vibration predicted
IN_PLANE: Final = (0.25, 0.5, 1.0, 2.0, 4.0)  # of the wall's stiffness, drawn in the plane


@click.command(
    "limit-cycles",
    short_help="Find the vibrations that keep themselves up on a wall of DEVICE.",
    epilog=example(
        "zwidth limit-cycles my-device.toml --stiffness 4000 --damping 1 --set loop.saturation.force_N=5",
        "zwidth limit-cycles my-device.toml --stiffness 900 --damping 1 --set loop.saturation.force_N=5 --json",
    ),
)
@about_a_device
@click.option("--stiffness", metavar="K", type=Finite(), required=True, help="Stiffness of the wall [N/m].")
@click.option("--damping", metavar="B", type=Finite(), required=True, help="Damping of the wall [Ns/m].")
@click.option(
    "--offset",
    metavar="SHARE",
    type=Bounded("steps", -0.5, 0.5),
    default=0.0,
    help="Where the vibration's middle lies, as a share of an encoder's step: 0.5 between two counts, as far as a "
    "constant push can do. Default: 0.",
)
@click.option("--no-simulation", is_flag=True, help="Predict only; simulate nothing.")
@click.option(
    "--plane",
    metavar="FILE",
    callback=named,
    help="Draw the friction-quantisation plane with the device in it (.png .svg .pdf).",
)
@output_option("Write a figure (.png .svg .pdf: growth over amplitude) or the data (.csv: the cycles, .json).")
@as_json
def limit_cycles(
    question: Question,
    stiffness: float,
    damping: float,
    offset: float,
    no_simulation: bool,
    plane: str | None,
    output: str | None,
    as_json: bool,
) -> int:
    """Find the vibrations that dry friction, encoder steps and the force limit keep up on a two-sided wall of
    DEVICE, and hold them against a simulation."""
    path = None if output is None else destination(output, FIGURES + DATA)
    drawn = None if plane is None else destination(plane, FIGURES)
    if path is not None and path == drawn:
        raise BadInput("--plane: names the file of --output; name another")
    device = question.device()
    wall = {"wall_stiffness_N_per_m": stiffness, "wall_damping_Ns_per_m": damping, "offset_steps": offset}
    if device.response is not None:
        return without_model(question, device, wall | dict.fromkeys(KEYS), as_json)
    facts = question.circumstances(device) | wall
    try:
        with computing(question), progress_told() as progress:
            loop = _loop(question, device)
            if not acting(loop):
                raise NoAnswer(NOTHING.format(_key(FRICTION, device), _key(STEPS, device)))
            _check(question, device, loop, stiffness, offset, drawn)
            largest = _largest_motion(question, device)
            found = predicted(loop, stiffness, damping, offset, largest, progress, simulate=not no_simulation)
    except NoAnswer as none:
        return deliver(Answer(facts | dict.fromkeys(KEYS), reason=str(none)), as_json)
    document = facts | numbers(found)
    if path is not None:
        document["file"] = str(path)
        _write(path, found, document)
    if drawn is not None:
        document["plane_file"] = str(drawn)
        _draw_plane(drawn, _in_plane(loop, stiffness))
    return deliver(Answer(document, lambda: list(_pages(question, device, found, document))), as_json)


def _loop(question: Question, device: Device) -> Loop:
    loop = question.point(device).loop
    _ = loop.sections  # refuses plants that no wall moves, or not in time
    return loop


def _largest_motion(question: Question, device: Device) -> float:
    """How far the device can move to either side of its posture [m]: a mechanism's handle along the direction,
    in its assembly; a [plant] as far as any device does."""
    from zwidth.contact.simulate import LARGEST_MOTION

    reached = question.point(device).handle_range
    if reached is None:
        return LARGEST_MOTION
    back, forth = reached
    # at the edge of the workspace it moves to one side only, and about a middle within that
    return min(-back, forth) or max(-back, forth) / 2.0


def _key(keys: tuple[str, str], device: Device) -> str:
    """Where a device file has it."""
    return keys[device.mechanism is not None]


def _check(
    question: Question, device: Device, loop: Loop, stiffness: float, offset: float, drawn: Path | None
) -> None:
    """Raises BadInput for what goes without encoder steps, or without a wall that pushes."""
    steps = "encoder steps" in acting(loop)
    if offset and not steps:
        raise BadInput(
            f"--offset: {question.name} has no encoder steps to lie between; give {_key(STEPS, device)}"
        )
    if drawn is None:
        return
    if not steps:
        raise BadInput(f"--plane: {question.name} has no encoder steps; give {_key(STEPS, device)}")
    if not stiffness > 0.0:
        raise BadInput(f"--plane: is drawn for walls with a positive stiffness, got {stiffness:g} N/m")
    _in_plane(loop, stiffness)


def _in_plane(loop: Loop, stiffness: float) -> DevicePlane:
    from zwidth.contact.plane import device_plane

    try:
        return device_plane(loop, [share * stiffness for share in IN_PLANE])
    except ValueError as error:
        raise BadInput(f"--plane: {error}") from None


def _pages(question: Question, device: Device, found: Predicted, document: dict[str, Any]) -> Iterator[Any]:
    yield heading(question, device, linear=False)
    far, whose = found.balance.largest_motion, "the handle moves" if device.mechanism else "taken to move"
    rows = [
        ("wall", f"{amount(found.stiffness, 'N/m')}, {amount(found.damping, 'Ns/m')}: {found.verdict} if linear"),
        ("not linear", ", ".join(found.parts)),
        ("range", f"{whose} {amount(far, 'm')} to either side at most"),
    ]
    if found.offset:
        rows.append(("middle", f"{given(found.offset)} of a step beyond a count"))
    if found.rest is not None:
        rows.append(("rests under every push", _up_to(found.rest)))
        rows.append(("hunts in no way", f"{_up_to(found.quiet)}, at this damping"))
    yield sheet(rows)
    if found.cycles:
        headings = ["limit cycle", "frequency", "speed", "force asked for", "what it is", "simulated"]
        yield table(headings, list(_rows(found)))
    else:
        yield "no limit cycle is predicted"
    yield from _remarks(found, [part for part in device.left_out if part in NOT_PREDICTED])
    for key in ("file", "plane_file"):
        if key in document:
            yield f"written: {document[key]}"


def _up_to(stiffness: float | None) -> str:
    return f"on walls up to {amount(stiffness, 'N/m')}" if stiffness else "on no wall"


def _rows(found: Predicted) -> Iterator[tuple[str, ...]]:
    for cycle, met in zip(found.cycles, found.met, strict=True):
        yield (
            amount(cycle.amplitude, "m"),
            amount(cycle.frequency_Hz, "Hz"),
            amount(cycle_speed(cycle), "m/s"),
            amount(cycle.force_amplitude, "N"),
            _kind(cycle),
            _said(met) if met else "",
        )


def _kind(cycle: LimitCycle) -> str:
    """What a limit cycle is to who stands before the device."""
    if not cycle.within_range:
        return "beyond the range: outside what the model holds for"
    return "stable: what is seen" if cycle.stable else "unstable: larger ones grow, smaller ones die"


def _elsewhere(cycle: LimitCycle, met: Met | None) -> bool:
    """Does the simulation go round at another frequency?"""
    if met is None or met.behaviour == "converged":
        return False
    return not 1.0 / OTHERWISE < met.frequency / cycle.frequency_Hz < OTHERWISE


def _said(met: Met) -> str:
    if met.behaviour == "converged":
        return "comes to rest"
    return f"{met.behaviour}, {amount(met.amplitude, 'm')} at {amount(met.frequency, 'Hz')}"


def _remarks(found: Predicted, without: Sequence[str]) -> Iterator[str]:
    if found.otherwise is not None:
        yield f"simulated from {amount(found.otherwise.start, 'm')}: {_said(found.otherwise)}"
    if any(_elsewhere(cycle, met) for cycle, met in zip(found.cycles, found.met, strict=True)):
        yield "the simulation vibrates otherwise than predicted; believe it: predictions follow one kind"
    if found.balance.leaves_range:
        yield "vibrations that grow leave this range: what stops them is not modelled"
    yield f"predicted by {found.by}"
    if without:
        yield f"the prediction leaves out {', '.join(without)}"
    if "encoder steps" in found.parts and "dry friction" not in found.parts:
        yield "without dry friction a device may rattle between two counts also where nothing is predicted"


def _write(path: Path, found: Predicted, document: dict[str, Any]) -> None:
    if path.suffix.lower() in DATA:
        write_data(path, document, columns(document))
        return
    from zwidth.show.figures.limit_cycles import draw_balance
    from zwidth.show.figures.style import context, figure, save

    drawing, ax = figure()
    with context():
        draw_balance(ax, found.balance)
    save(drawing, path)


def _draw_plane(path: Path, device: DevicePlane) -> None:
    from zwidth.show.figures.limit_cycles import draw_plane
    from zwidth.show.figures.style import context, figure, save

    drawing, ax = figure()
    with context():
        draw_plane(ax, device)
    save(drawing, path)
