"""`zwidth limit-cycles`: which vibrations keep themselves up on a wall?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import sheet, table
from zwidth.show.cli.command import Case, Command
from zwidth.show.cli.contact_options import Bounded, wall_options
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.failures import NoAnswer
from zwidth.show.cli.options import named
from zwidth.show.cli.progress import progress_told
from zwidth.show.output import FIGURES, destination
from zwidth.show.units import amount, given

if TYPE_CHECKING:
    from zwidth.contact.limit_cycle_prediction import LimitCyclePrediction, SimulatedVibration
    from zwidth.contact.limit_cycles import LimitCycle
    from zwidth.contact.plane import DevicePlane

FRICTION: Final = ("friction.coulomb_N", "mechanism.drives.*.coulomb_Nm")  # of a [plant], of a [mechanism]
STEPS: Final = ("loop.encoder.resolution_m", "mechanism.drives.*.encoder_counts_per_rev")
NOTHING: Final = (
    "nothing in this device depends on the amplitude, so that no vibration keeps its size; give it dry "
    "friction ({}), encoder steps ({}) or a largest force (loop.saturation.force_N), in the file or by --set"
)
IN_PLANE: Final = (0.25, 0.5, 1.0, 2.0, 4.0)  # of the wall's stiffness, drawn in the plane


class LimitCycles(Command):
    """Find the vibrations that dry friction, encoder steps and the force limit keep up on a two-sided wall of
    DEVICE, and hold them against a simulation."""

    name = "limit-cycles"
    summary = "Find the vibrations that keep themselves up on a wall of DEVICE."
    examples = (
        "zwidth limit-cycles my-device.toml --stiffness 4000 --damping 1 --set loop.saturation.force_N=5",
        "zwidth limit-cycles my-device.toml --stiffness 900 --damping 1 --set loop.saturation.force_N=5 --json",
    )
    options = (
        *wall_options(),
        click.option(
            "--offset",
            metavar="SHARE",
            type=Bounded("steps", -0.5, 0.5),
            default=0.0,
            help="Where the vibration's middle lies, as a share of an encoder's step: 0.5 between two counts, as "
            "far as a constant push can do. Default: 0.",
        ),
        click.option("--no-simulation", is_flag=True, help="Predict only; simulate nothing."),
        click.option(
            "--plane",
            metavar="FILE",
            callback=named,
            help="Draw the friction-quantisation plane with the device in it (.png .svg .pdf).",
        ),
    )
    output_help = "Write a figure (.png .svg .pdf: growth over amplitude) or the data (.csv: the cycles, .json)."
    keys = (
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
    linear = False

    def check(self, case: Case) -> None:
        if case["plane"] is not None and destination(case["plane"], FIGURES) == case.path:
            raise BadInput("--plane: names the file of --output; name another")

    def asked(self, case: Case) -> dict[str, Any]:
        return {
            "wall_stiffness_N_per_m": case["stiffness"],
            "wall_damping_Ns_per_m": case["damping"],
            "offset_steps": case["offset"],
        }

    def compute(self, case: Case) -> LimitCyclePrediction:
        from zwidth.contact.predict_limit_cycles import (
            NoEncoderStepsError,
            NothingNonlinearError,
            amplitude_dependent,
            predict_limit_cycles,
        )

        name, offset = case.question.name, case["offset"]
        try:
            parts = amplitude_dependent(case.point, offset)
        except NothingNonlinearError:
            raise NoAnswer(NOTHING.format(_key(FRICTION, case), _key(STEPS, case))) from None
        except NoEncoderStepsError:
            lacking = f"{name} has no encoder steps to lie between"
            raise BadInput(f"--offset: {lacking}; give {_key(STEPS, case)}") from None
        if case["plane"] is not None:
            if "encoder steps" not in parts:
                raise BadInput(f"--plane: {name} has no encoder steps; give {_key(STEPS, case)}")
            _plane(case)  # whether it can be drawn, before the long computation
        with progress_told() as progress:
            return predict_limit_cycles(
                case.point,
                case["stiffness"],
                case["damping"],
                offset=offset,
                simulate=not case["no_simulation"],
                progress=progress,
            )

    def pages(self, case: Case, result: LimitCyclePrediction, document: Mapping[str, Any]) -> Iterator[Any]:
        yield sheet(list(_circumstances(case, result)))
        if result.cycles:
            headings = ["limit cycle", "frequency", "speed", "force asked for", "what it is", "simulated"]
            yield table(headings, list(_rows(result)))
        else:
            yield "no limit cycle is predicted"
        yield from _remarks(result)

    def write_others(self, case: Case, result: LimitCyclePrediction) -> dict[str, Path]:
        if case["plane"] is None:
            return {}
        from zwidth.show.figures.limit_cycles import draw_plane
        from zwidth.show.figures.style import context, figure, save

        path = destination(case["plane"], FIGURES)
        drawing, ax = figure()
        with context():
            draw_plane(ax, _plane(case))
        save(drawing, path)
        return {"plane_file": path}


def _key(keys: tuple[str, str], case: Case) -> str:
    """Where the device's file has it."""
    return keys[case.device.mechanism is not None]


def _plane(case: Case) -> DevicePlane:
    """The device in the friction-quantisation plane. Raises BadInput for a wall that does not push, and so on."""
    from zwidth.contact.plane import device_plane

    stiffness = case["stiffness"]
    if not stiffness > 0.0:
        raise BadInput(f"--plane: is drawn for walls with a positive stiffness, got {stiffness:g} N/m")
    try:
        return device_plane(case.point.loop, [share * stiffness for share in IN_PLANE])
    except ValueError as error:
        raise BadInput(f"--plane: {error}") from None


def _circumstances(case: Case, found: LimitCyclePrediction) -> Iterator[tuple[str, str]]:
    wall = f"{amount(found.wall_stiffness, 'N/m')}, {amount(found.wall_damping, 'Ns/m')}"
    yield "wall", f"{wall}: {found.verdict} if linear"
    yield "not linear", ", ".join(found.nonlinear)
    whose = "the handle moves" if case.device.mechanism else "taken to move"
    yield "range", f"{whose} {amount(found.largest_motion, 'm')} to either side at most"
    if found.offset:
        yield "middle", f"{given(found.offset)} of a step beyond a count"
    if found.resting_limit is not None:
        yield "rests under every push", _up_to(found.resting_limit)
        yield "hunts in no way", f"{_up_to(found.quiet_limit)}, at this damping"


def _up_to(stiffness: float | None) -> str:
    return f"on walls up to {amount(stiffness, 'N/m')}" if stiffness else "on no wall"


def _rows(found: LimitCyclePrediction) -> Iterator[tuple[str, ...]]:
    from zwidth.contact.limit_cycle_prediction import cycle_speed

    for cycle, simulated in zip(found.cycles, found.simulated, strict=True):
        yield (
            amount(cycle.amplitude, "m"),
            amount(cycle.frequency_Hz, "Hz"),
            amount(cycle_speed(cycle), "m/s"),
            amount(cycle.force_amplitude, "N"),
            _kind(cycle),
            _said(simulated) if simulated else "",
        )


def _kind(cycle: LimitCycle) -> str:
    """What a limit cycle is to who stands before the device."""
    if not cycle.within_range:
        return "beyond the range: outside what the model holds for"
    return "stable: what is seen" if cycle.stable else "unstable: larger ones grow, smaller ones die"


def _said(simulated: SimulatedVibration) -> str:
    if simulated.behaviour == "converged":
        return "comes to rest"
    return f"{simulated.behaviour}, {amount(simulated.amplitude, 'm')} at {amount(simulated.frequency, 'Hz')}"


def _remarks(found: LimitCyclePrediction) -> Iterator[str]:
    if found.otherwise is not None:
        yield f"simulated from {amount(found.otherwise.start, 'm')}: {_said(found.otherwise)}"
    if found.simulated_otherwise:
        yield "the simulation vibrates otherwise than predicted; believe it: predictions follow one kind"
    if found.leaves_range:
        yield "vibrations that grow leave this range: what stops them is not modelled"
    yield f"predicted by {found.predicted_by}"
    if found.left_out:
        yield f"the prediction leaves out {', '.join(found.left_out)}"
    if "encoder steps" in found.nonlinear and "dry friction" not in found.nonlinear:
        yield "without dry friction a device may rattle between two counts also where nothing is predicted"
