"""`zwidth limit-cycles`: the sustained vibrations on a wall."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from zwidth.errors import NoAnswerError
from zwidth.questions import LIMIT_CYCLES
from zwidth.show.cli.answer import answer_table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import options_of
from zwidth.show.output import FIGURES, destination
from zwidth.show.units import amount, as_written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.contact.friction_quantisation_plane import DevicePlane
    from zwidth.contact.harmonic_balance import LimitCycle
    from zwidth.contact.wall_limit_cycles import LimitCycleAnswer, LimitCyclePrediction, SimulatedVibration

FRICTION_KEYS: Final = ("friction.coulomb_N", "mechanism.drives.*.coulomb_Nm")  # of a [plant], of a [mechanism]
ENCODER_KEYS: Final = ("loop.encoder.resolution_m", "mechanism.drives.*.encoder_counts_per_rev")
NOTHING_NONLINEAR: Final = (
    "nothing in this device depends on the amplitude, so it has no limit cycle; give it dry "
    "friction ({}), encoder steps ({}) or a largest force (loop.saturation.force_N), in the file or by --set"
)
PLANE_STIFFNESSES: Final = (0.25, 0.5, 1.0, 2.0, 4.0)  # of the wall's stiffness, drawn in the plane


class LimitCyclesCommand(Command):
    """Find the limit cycles that dry friction, encoder steps and the force limit sustain on a two-sided wall of
    DEVICE, and compare them with a simulation."""

    name = "limit-cycles"
    summary = "Find the limit cycles (sustained vibrations) on a wall of DEVICE."
    examples = (
        "zwidth limit-cycles my-device.toml --stiffness 4000 --damping 1 --set loop.saturation.force_N=5",
        "zwidth limit-cycles my-device.toml --stiffness 900 --damping 1 --set loop.saturation.force_N=5 --json",
    )
    options = options_of(LIMIT_CYCLES)
    output_help = "Write a figure (.png .svg .pdf: growth over amplitude) or the data (.csv: the cycles, .json)."
    keys = (
        "verdict",
        "nonlinear",
        "predicted_by",
        "limit_cycles",
        "contradicted",
        "otherwise",
        "largest_motion_m",
        "leaves_range",
        "resting_limit_N_per_m",
        "quiet_limit_N_per_m",
        "growth",
    )
    linear = False

    def check(self, case: CommandLine) -> None:
        if case["plane"] is not None and destination(case["plane"], FIGURES) == case.path:
            raise BadInput("--plane: is the same file as --output; name another")

    def repeated_options(self, case: CommandLine) -> dict[str, Any]:
        return {
            "wall_stiffness_N_per_m": case["stiffness"],
            "wall_damping_Ns_per_m": case["damping"],
            "offset_steps": case["offset"],
        }

    def compute(self, case: CommandLine) -> LimitCyclePrediction:
        """The prediction.

        Raises  NoAnswerError  where nothing depends on the amplitude
                BadInput       for --offset or --plane without encoder steps, and as `_device_in_plane`
        """
        from zwidth.contact.wall_limit_cycles import amplitude_dependent, predict_limit_cycles
        from zwidth.errors import ArgumentError

        name, offset = case.question.name, case["offset"]
        try:
            parts = amplitude_dependent(case.point, offset)
        except NoAnswerError:
            raise NoAnswerError(
                NOTHING_NONLINEAR.format(_device_key(FRICTION_KEYS, case), _device_key(ENCODER_KEYS, case))
            ) from None
        except ArgumentError:
            lacking = f"{name} has no encoder steps"
            raise BadInput(f"--offset: {lacking}; give {_device_key(ENCODER_KEYS, case)}") from None
        if case["plane"] is not None:
            if "encoder steps" not in parts:
                raise BadInput(f"--plane: {name} has no encoder steps; give {_device_key(ENCODER_KEYS, case)}")
            _device_in_plane(case)  # whether it can be drawn, before the long computation
        return predict_limit_cycles(
            case.point,
            case["stiffness"],
            case["damping"],
            offset=offset,
            simulate=not case["no_simulation"],
            progress=case.progress,
        )

    def pages(self, case: CommandLine, result: LimitCyclePrediction, document: Mapping[str, Any]) -> Iterator[Any]:
        """The circumstances, a row for each cycle, and remarks."""
        yield two_columns(list(_circumstance_rows(case, result)))
        if result.cycles:
            yield answer_table(_headings(result), list(_rows(result)))
        else:
            yield result.none_found
        yield from _remarks(result)

    def write_others(self, case: CommandLine, result: LimitCyclePrediction) -> dict[str, Path]:
        """Draw the friction-quantisation plane into the file of --plane."""
        if case["plane"] is None:
            return {}
        from zwidth.show.figures.limit_cycles import draw_plane
        from zwidth.show.figures.style import figure

        def draw() -> Figure:
            drawing, ax = figure()
            draw_plane(ax, _device_in_plane(case))
            return drawing

        path = destination(case["plane"], FIGURES)
        self.save_figure(case, draw, path, {})
        return {"plane_file": path}


def _device_key(keys: tuple[str, str], case: CommandLine) -> str:
    """The key for this device's file, of a pair: that of a [plant], and that of a [mechanism]."""
    return keys[case.device.mechanism is not None]


def _device_in_plane(case: CommandLine) -> DevicePlane:
    """The device in the friction-quantisation plane, on walls of PLANE_STIFFNESSES times the stiffness.

    Raises  BadInput  for a wall without positive stiffness, and for a loop that has no place in the plane
    """
    from zwidth.contact.friction_quantisation_plane import device_plane

    stiffness = case["stiffness"]
    if not stiffness > 0.0:
        raise BadInput(f"--plane: is drawn for walls with a positive stiffness, got {stiffness:g} N/m")
    try:
        return device_plane(case.point.loop, [share * stiffness for share in PLANE_STIFFNESSES])
    except ValueError as error:
        raise BadInput(f"--plane: {error}") from None


def _circumstance_rows(case: CommandLine, prediction: LimitCyclePrediction) -> Iterator[tuple[str, str]]:
    """Rows (label, value) above the cycles: wall, nonlinear parts, range of motion, walls without hunting."""
    wall = f"{amount(prediction.wall_stiffness, 'N/m')}, {amount(prediction.wall_damping, 'N s/m')}"
    yield "wall", f"{wall}: {prediction.verdict} if linear"
    yield "nonlinear parts", ", ".join(prediction.nonlinear)
    whose = "the handle moves" if case.device.mechanism else "taken to move"
    yield "range", f"{whose} {amount(prediction.largest_motion, 'm')} to either side at most"
    if prediction.offset:
        yield "middle", f"{as_written(prediction.offset)} of a step from the nearest count"
    if prediction.resting_limit is not None:
        yield "rests under every push", _up_to(prediction.resting_limit)
        yield "no encoder hunting", f"{_up_to(prediction.quiet_limit)}, at this damping"


def _up_to(stiffness: float | None) -> str:
    """Walls up to a stiffness [N/m], in words; None or 0: none."""
    return f"on walls up to {amount(stiffness, 'N/m')}" if stiffness else "on no wall"


def _has_source_column(prediction: LimitCyclePrediction) -> bool:
    """Whether the table has a column of what each cycle is from: not where all are from the prediction."""
    return any(answer.source == "simulation" for answer in prediction.answers)


def _headings(prediction: LimitCyclePrediction) -> list[str]:
    """Headings of the table of the cycles."""
    source = ["from"] if _has_source_column(prediction) else []
    return ["limit cycle", "frequency", *source, "speed", "commanded force", "kind", "simulated"]


def _rows(prediction: LimitCyclePrediction) -> Iterator[tuple[str, ...]]:
    """Cells of each cycle, below `_headings`."""
    for answer in prediction.answers:
        cycle = answer.cycle
        source = ["simulation" if answer.source == "simulation" else "prediction"]
        yield (
            amount(cycle.amplitude, "m"),
            amount(cycle.frequency_Hz, "Hz"),
            *(source if _has_source_column(prediction) else []),
            amount(cycle.speed, "m/s"),
            "" if isnan(cycle.force_amplitude) else amount(cycle.force_amplitude, "N"),
            _kind_text(cycle),
            _simulated_text(answer),
        )


def _simulated_text(answer: LimitCycleAnswer) -> str:
    """What the simulation says of a cycle; "" of one that it does not look for, as an unstable one."""
    if answer.simulated is None:
        return "" if not answer.cycle.stable or not answer.cycle.within_range else "not confirmed: not simulated"
    if answer.source == "simulation":
        predicted = answer.predicted
        if predicted is None:
            return "none is predicted"
        return f"predicted: {amount(predicted.amplitude, 'm')} at {amount(predicted.frequency_Hz, 'Hz')}"
    return ("" if answer.confirmed else "not confirmed: ") + _vibration_text(answer.simulated)


def _kind_text(cycle: LimitCycle) -> str:
    """Describe a limit cycle as a user of the device would see or hear it."""
    if not cycle.within_range:
        return "beyond the range: outside what the model holds for"
    return "stable: persists" if cycle.stable else "unstable: larger ones grow, smaller ones die out"


def _vibration_text(simulated: SimulatedVibration) -> str:
    """What a simulation ended in: rest, or a vibration with its amplitude and frequency."""
    if simulated.behaviour in ("converged", "decaying"):
        return "comes to rest"
    return f"{simulated.behaviour}, {amount(simulated.amplitude, 'm')} at {amount(simulated.frequency, 'Hz')}"


def _remarks(prediction: LimitCyclePrediction) -> Iterator[str]:
    """Sentences below the cycles: what a simulation says beside them, and what the prediction leaves out."""
    if prediction.small_start_vibration is not None:
        small = prediction.small_start_vibration
        yield f"simulated from {amount(small.start, 'm')}: {_vibration_text(small)}"
    if prediction.simulation_disagrees:
        yield (
            "the simulation disagrees with the prediction, which is an approximation; what is simulated is "
            "given in its place"
        )
    for answer in prediction.contradicted:
        if answer.simulated is not None:
            gone = f"{amount(answer.cycle.amplitude, 'm')} at {amount(answer.cycle.frequency_Hz, 'Hz')}"
            yield f"predicted, and not there when simulated: {gone} ({_vibration_text(answer.simulated)})"
    if prediction.leaves_range:
        yield "vibrations that grow leave this range: what stops them is not modelled"
    yield f"predicted by {prediction.predicted_by}"
    if prediction.left_out:
        yield f"the prediction leaves out {', '.join(prediction.left_out)}"
    if "encoder steps" in prediction.nonlinear and "dry friction" not in prediction.nonlinear:
        yield "without dry friction a device may rattle between two counts even where nothing is predicted"
