"""`zwidth simulate`: what happens on contact.

What people read of a simulated contact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.questions import SIMULATE
from zwidth.show.cli.answer import ROUNDING, Row, answer_table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.contact_options import (
    ParameterType,
    check_contact,
    contact_arguments,
    translate_contact_errors,
    usage_error,
)
from zwidth.show.cli.options import Number, options_of
from zwidth.show.output import DATA, FIGURES
from zwidth.show.units import HEADINGS, amount, as_written, energy_rows, percent, signed, typed, uncertain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.contact.contact_simulation import ContactSimulation
    from zwidth.contact.environments import Environment
    from zwidth.contact.hand import Hand


SOUND: Final = (".wav",)
NUMBERS_PER_SAMPLE: Final = 17  # numbers kept of each sample
AS_TEXT: Final = 49  # numbers' worth of memory that each sample takes as text
NUMBERS_OF_SOUND: Final = 48_000 * 6  # numbers kept of each second of a sound


class PitchFactor(Number):
    """A factor of the pitch, or "auto"."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return value if value == "auto" else super().convert(value, param, ctx)


class SimulateCommand(Command):
    """Simulate a contact of DEVICE with a wall: the motion dies away, grows, repeats itself or leaves the wall."""

    name = "simulate"
    takes_responses = True
    answers_by_fit = True
    summary = "Simulate a contact of DEVICE with a wall."
    examples = (
        "zwidth simulate my-device.toml --stiffness 4000 --damping 10 --output motion.svg",
        "zwidth simulate my-device.toml --stiffness 4000 --damping 10 --wall one-sided --output heard.wav",
        "zwidth simulate my-device.toml --stiffness 9000 --damping 10 --output heard.wav --sound-full-scale 1 "
        "--sound-pitch auto",
    )
    options = options_of(SIMULATE, parameters=ParameterType(), sound_pitch=PitchFactor(SIMULATE["sound_pitch"]))
    outputs = FIGURES + DATA + SOUND
    output_help = "Write a figure (.png .svg .pdf), the data (.csv .json), or the handle's sound (.wav)."
    keys = (
        "environment",
        "parameters",
        "wall_stiffness_N_per_m",
        "wall_damping_Ns_per_m",
        "wall_position_m",
        "start",
        "hand",
        "duration_s",
        "duration_asked_s",
        "substeps",
        "seed",
        "stable",
        "behaviour",
        "frequency_Hz",
        "dominant_frequency_Hz",
        "handle_amplitude_m",
        "amplitude_m",
        "growth_per_sample",
        "predicted_growth_per_sample",
        "contact_share",
        "limited_share",
        "given_up",
        "ledger_J",
        "ledger_imbalance",
        "passivity",
        "time_s",
        "position_m",
        "penetration_m",
        "velocity_m_per_s",
        "force_N",
        "handle_m",
        "energy_J",
    )
    linear = False

    def check(self, case: CommandLine) -> None:
        """Refuse options of a contact, or of a sound, that do not go together."""
        check_contact(case.options)
        for name in ("sound_full_scale", "sound_pitch"):
            if case[name] is not None and not case.writes(SOUND):
                raise usage_error(f"--{name.replace('_', '-')} belongs to a sound; add --output FILE.wav")

    def compute(self, case: CommandLine) -> ContactSimulation:
        """The simulated contact; wrong options become BadInput under their names.

        Fewer substeps than asked for, of a linear device, are told on standard error.
        """
        from zwidth.contact.point_contact import simulate_contact
        from zwidth.show.sound import seconds_to_hear

        run_options = ("duration", "substeps", "seed", "passivity_damping")
        with translate_contact_errors():
            _check_memory(case)
            simulation = simulate_contact(
                case.point,
                **contact_arguments(case.options),
                **{name: case[name] for name in run_options},
                trail=case.writes(FIGURES + SOUND),
                progress=case.progress,
                seconds_to_hear=partial(seconds_to_hear, pitch=case["sound_pitch"])
                if case.writes(SOUND)
                else None,
            )
        if simulation.substeps < case["substeps"]:
            exact = f"a linear device is exact with any number; {simulation.substeps} were taken"
            click.echo(f"--substeps {case['substeps']}: {exact}", err=True)
        return simulation

    def pages(self, case: CommandLine, result: ContactSimulation, document: Mapping[str, Any]) -> Iterator[Any]:

        yield from simulation_page(result, document.get("sound"))

    def draw(self, case: CommandLine, result: ContactSimulation) -> Figure:
        from zwidth.show.figures.contact_response import contact_figure, draw_contact

        drawing, axes = contact_figure()
        draw_contact(axes, result.response)
        return drawing

    def write(
        self, case: CommandLine, result: ContactSimulation, document: dict[str, Any], reason: str | None
    ) -> str | None:
        """Write the sound, or what every command writes. Returns why nothing is to be heard."""
        if not case.writes(SOUND):
            return super().write(case, result, document, reason)
        from zwidth.errors import NoAnswerError
        from zwidth.show.sound import sound_of, write_sound

        assert case.path is not None
        try:
            sound = sound_of(result.response, case["sound_pitch"], case["sound_full_scale"])
        except NoAnswerError as error:
            del document["file"]
            return str(error)
        write_sound(case.path, sound)
        document["sound"] = sound.document()
        return reason


def _check_memory(case: CommandLine) -> None:
    """Raise TooLarge for more samples than there is memory for, with their text and a sound of a given pitch."""
    from zwidth.resources import check_memory

    if case["duration"] is None:
        return
    samples = case["duration"] / case.device.controller.sampling_period
    runs = 1 if case["passivity_damping"] is None else 2
    pitch = case["sound_pitch"]
    sound = NUMBERS_OF_SOUND * case["duration"] / pitch if isinstance(pitch, float) else 0.0
    numbers = samples * (AS_TEXT + NUMBERS_PER_SAMPLE * runs) + sound
    check_memory(numbers, f"{samples:.4g} samples", "simulate a shorter time")


BEHAVIOUR_VERDICTS: Final = {
    "converged": "stable: it comes to rest",
    "decaying": "stable: the vibration dies away",
    "drifting": "stable: it moves on steadily under the push, as no stiffness holds a position",
    "growing": "not stable: the vibration grows",
    "limit cycle": "not stable: a limit cycle, which neither grows nor dies away",
    "bouncing": "not stable: it bounces in and out without an end",
    "lost contact": "not stable: contact is lost, and does not come back",
    "forced": "undecided: it follows the hand's tremor; leave out --tremor to see what the wall does by itself",
    "undecided": "undecided: this run does not tell; try a longer --duration",
}
NEAR_NYQUIST: Final = 0.9  # share of half the sampling rate from which a vibration alternates between samples
ENERGY_ERROR: Final = 1e-6  # of the largest energy, above which the imbalance is told


def simulation_page(simulation: ContactSimulation, sound: Mapping[str, Any] | None) -> Iterator[Any]:
    """The verdict, the circumstances, the numbers, the energies, what is worth a remark, and a sound if one was
    written."""
    yield _verdict_sentence(simulation)
    yield two_columns([*_circumstance_rows(simulation), *_result_rows(simulation)])
    yield answer_table(HEADINGS, list(energy_rows(simulation.ledger, float(simulation.energy[-1]))))
    yield from _remarks(simulation)
    if sound is not None:
        yield from _sound_sentences(sound)


def _verdict_sentence(simulation: ContactSimulation) -> str:
    """The verdict on a contact, in words."""
    if simulation.behaviour == "undecided" and simulation.range_exit is not None:
        return "undecided: the motion leaves the range of the handle before the run decides"
    return BEHAVIOUR_VERDICTS[simulation.behaviour]


def _circumstance_rows(simulation: ContactSimulation) -> Iterator[Row]:
    """Rows (label, value) on what a contact was given: environment, start, hand and simulated time."""
    place = f", at {amount(simulation.wall_position, 'm')}" if simulation.wall_position else ""
    yield "environment", f"{environment_words(simulation.environment, simulation.parameters)}{place}"
    yield "start", _start_text(simulation)
    yield "hand", _hand_text(simulation.hand)
    why = f" ({simulation.length.reason})"
    yield "simulated", f"{amount(float(simulation.time[-1]), 's')}, {len(simulation.time)} samples{why}"


def environment_words(environment: Environment, values: Mapping[str, float]) -> str:
    """An environment and its parameters: "slot: width 5 mm, stiffness 1 kN/m, damping 0 N s/m"."""
    units = {parameter.name: parameter.unit for parameter in environment.parameters if not parameter.switch}
    texts = [f"{name.replace('_', ' ')} {_parameter_text(values[name], unit)}" for name, unit in units.items()]
    texts += [name.replace("_", " ") for name, on in values.items() if name not in units and on]
    name = "two-sided wall" if environment.name == "wall" else environment.name
    return f"{name}: {', '.join(texts)}" if texts else name


def _parameter_text(value: float, unit: str) -> str:
    """A parameter with its unit; "inf" for an infinite one, which an environment may take."""
    return amount(value, unit) if isfinite(value) else "inf"


def _start_text(simulation: ContactSimulation) -> str:
    """Where the device starts, from the surface, and how fast, in words."""
    depth = simulation.start_position - simulation.wall_position
    where = f"{amount(abs(depth), 'm')} {'inside' if depth > 0.0 else 'outside'}" if depth else "at its position"
    beside = simulation.distance_from_path or 0.0
    path = f", {amount(beside, 'm')} beside the handle's path" if beside > ROUNDING else ""
    moving = (
        f"at {typed(as_written(simulation.start_velocity, 'm/s'))}" if simulation.start_velocity else "at rest"
    )
    return f"{where}, {moving}{path}"


def _hand_text(hand: Hand) -> str:
    """What the hand does, in words."""
    texts = []
    if hand.push:
        ramp = f", growing over {amount(hand.ramp, 's')}" if hand.ramp else ""
        texts.append(f"pushes with {amount(hand.push, 'N')}{ramp}")
    if hand.reach:
        texts.append(f"reaches by {amount(hand.reach.distance, 'm')} in {amount(hand.reach.duration, 's')}")
    if hand.tremor:
        trembling = f"{amount(hand.tremor.amplitude, 'N')} at {amount(hand.tremor.frequency, 'Hz')}"
        texts.append(f"trembles with {trembling}")
    if hand.reflex:
        stiffer = amount(hand.reflex.arm_stiffness, "N/m")
        texts.append(f"stiffens by {stiffer} above {amount(hand.reflex.threshold, 'N')}")
    return ", ".join(texts) or "does not push"


def _result_rows(simulation: ContactSimulation) -> Iterator[Row]:
    """Rows (label, value) on a contact: amplitude, frequency, growth, share of contact, limit, controller."""
    yield "amplitude at the end", amount(simulation.amplitude, "m")
    if isfinite(simulation.dominant_frequency):
        yield "dominant frequency", amount(simulation.dominant_frequency, "Hz")
    no_growth = "too fast to determine" if simulation.given_up else "no motion is left"
    growth = f"{typed(signed(simulation.growth))} per sample" if isfinite(simulation.growth) else no_growth
    if simulation.predicted_growth is not None:
        left = simulation.loop.plant.nonlinear.kinds  # what the eigenvalues leave out
        linear = " of the linear loop" if left or isfinite(simulation.force_limit) else ""
        growth += f"; by the eigenvalues{linear} {typed(signed(simulation.predicted_growth))}"
    yield "growth", growth
    if simulation.environment.surface:
        yield "in contact", f"{typed(percent(simulation.contact_share))} of the second half"
    if simulation.limited_share > 0.0:
        share = f"{typed(percent(simulation.limited_share))} of the samples"
        yield "at the force limit", f"{share}, {amount(simulation.force_limit, 'N')}"
    if simulation.passivity is not None:
        yield "rendered stiffness", amount(simulation.passivity.rendered_stiffness, "N/m")
        other = amount(simulation.passivity.uncontrolled_stiffness, "N/m")
        yield "without controller", f"{other}; {BEHAVIOUR_VERDICTS[simulation.passivity.uncontrolled.behaviour]}"


def _remarks(simulation: ContactSimulation) -> Iterator[str]:
    """Sentences on what is worth a remark, such as a start inside the wall or a motion below an encoder step."""
    import numpy as np

    if simulation.environment.surface and simulation.starts_inside:
        yield "starts inside the wall"
    if not np.ptp(simulation.handle) > 0.0 and _pushed_against_friction(simulation):
        largest = amount(float(np.max(np.abs(simulation.force))), "N")
        yield f"dry friction holds it: the wall's force, {largest}, and the hand's do not overcome it"
    elif not np.ptp(simulation.handle) > 0.0:
        yield "nothing moves the handle: give --push, --start-velocity or --start-position"
    if simulation.given_up:
        yield "stopped early: the device was farther from the wall than any device moves"
    if (beyond := simulation.range_exit) is not None:
        back, forth = amount(beyond.backward, "m"), amount(beyond.forward, "m")
        yield (
            f"from {amount(beyond.time, 's')} on the run is not valid for this device: along this direction "
            f"its handle gets from {back} to {forth}, and the model knows no end of the way; `zwidth move` does"
        )
    if simulation.response.quantum > 2.0 * simulation.amplitude > 0.0:
        yield f"the motion is smaller than the encoder's step of {amount(simulation.response.quantum, 'm')}"
    if simulation.dominant_frequency > NEAR_NYQUIST * 0.5 / simulation.loop.period:
        yield "the vibration is close to half the sampling rate: it alternates from sample to sample"
    if simulation.environment.surface and abs(simulation.hand.push) > simulation.force_limit:
        yield "the hand pushes harder than the force limit"
    if simulation.loop.plant.handle is None:
        yield "the plant names no handle: it is assumed to be at the sensor"
    if simulation.response.imbalance > ENERGY_ERROR:
        missing = typed(uncertain(100.0 * simulation.response.imbalance))
        yield f"the energies do not add up: the error is {missing} % of the largest"


def _pushed_against_friction(simulation: ContactSimulation) -> bool:
    """Whether the wall or the hand pushes, and the device has dry friction that acts against it."""
    import numpy as np

    pushed = bool(np.any(simulation.force != 0.0)) or simulation.hand.push != 0.0
    return pushed and "dry friction" in simulation.loop.plant.nonlinear.kinds


def _sound_sentences(sound: Mapping[str, Any]) -> Iterator[str]:
    """How long, how fast and how loud the sound is; and a pitch at which a loudspeaker renders more of it."""
    speed, frequency = sound["speed"], sound["frequency_Hz"]
    text = f"sound: {amount(sound['seconds'], 's')}"
    if speed != 1.0:
        how = f"{speed:g} times faster" if speed > 1.0 else f"{1.0 / speed:g} times slower"
        text += f", {how}: {amount(frequency / speed, 'Hz')} sounds as {amount(frequency, 'Hz')}"
    else:
        text += f", {amount(frequency, 'Hz')}"
    if sound["repeats"] > 1:
        text += f"; the run {sound['repeats']} times over"
    level = sound["peak_dBFS"]
    where = f"{abs(level):.1f} dB {'above' if level > 0.0 else 'below'} it"
    text += f"; full scale is {amount(sound['full_scale_m_per_s'], 'm/s')}, the peak {where}"
    if sound["clipped_share"] > 0.0:
        text += f", {typed(percent(sound['clipped_share']))} of the samples clipped"
    yield text
    if sound["suggested_pitch"] is not None:
        low = typed(percent(sound["share_below_200_Hz"]))
        yield (
            f"{low} of its energy is below 200 Hz, of which small loudspeakers render little; "
            f"try --sound-pitch {sound['suggested_pitch']:g}"
        )
