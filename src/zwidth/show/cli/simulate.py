"""`zwidth simulate`: what happens on contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.contact_options import (
    LARGEST_SEED,
    BoundedNumber,
    check_contact,
    contact_arguments,
    contact_options,
    translate_contact_errors,
    usage_error,
)
from zwidth.show.cli.options import ParamType
from zwidth.show.output import DATA, FIGURES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.contact.contact_simulation import ContactSimulation

SOUND: Final = (".wav",)
LONGEST: Final = 1e9  # s
NUMBERS_PER_SAMPLE: Final = 17  # numbers kept of each sample
AS_TEXT: Final = 49  # numbers' worth of memory that each sample takes as text
NUMBERS_OF_SOUND: Final = 48_000 * 6  # numbers kept of each second of a sound
LOWEST_PITCH: Final = 0.1
HIGHEST_PITCH: Final = 1000.0


class PitchFactor(ParamType):
    """A factor of the pitch, or "auto"."""

    name = "factor"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        if value == "auto":
            return "auto"
        try:
            factor = float(value)
        except ValueError:
            factor = 0.0
        if not LOWEST_PITCH <= factor <= HIGHEST_PITCH:
            allowed = f"auto or a factor from {LOWEST_PITCH:g} to {HIGHEST_PITCH:g}"
            self.fail(f"must be {allowed}, got {str(value)[:60]!r}", param, ctx)
        return factor


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
    options = (
        *contact_options(),
        click.option(
            "--duration",
            metavar="S",
            type=BoundedNumber("s", 0.0, LONGEST, above=True),
            help="Simulated time [s]. Default: a tenfold change at the predicted rate, and at least eight "
            "periods, at most 60 s.",
        ),
        click.option(
            "--substeps",
            type=click.IntRange(1, 100_000),
            default=20,
            help="Integration steps per sample, where the device or the environment is not linear. Default: 20.",
        ),
        click.option(
            "--seed",
            type=click.IntRange(0, LARGEST_SEED),
            default=0,
            help="Seed of the encoders' noise. Default: 0.",
        ),
        click.option(
            "--passivity",
            "passivity_damping",
            metavar="B",
            type=BoundedNumber("Ns/m", 0.0, 1e15, above=True),
            help="Add a time-domain passivity controller, whose damper is at most B [Ns/m].",
        ),
        click.option(
            "--sound-full-scale",
            metavar="V",
            type=BoundedNumber("m/s", 1e-9, 1e9),
            help="Velocity of the handle at full scale of a .wav [m/s], the same for files to be compared; "
            "faster is clipped. Default: each file at its own full scale.",
        ),
        click.option(
            "--sound-pitch",
            metavar="FACTOR|auto",
            type=PitchFactor(),
            help="Raise all frequencies of a .wav by this factor; auto: by octaves, to above 200 Hz. "
            "Default: by octaves, from below 60 Hz to above 110 Hz.",
        ),
    )
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
        "dominant_frequency_Hz",
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
        check_contact(case.options)
        for name in ("sound_full_scale", "sound_pitch"):
            if case[name] is not None and not case.writes(SOUND):
                raise usage_error(f"--{name.replace('_', '-')} belongs to a sound; add --output FILE.wav")

    def compute(self, case: CommandLine) -> ContactSimulation:
        from zwidth.contact.simulate_contact import simulate_contact
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
        from zwidth.show.cli.simulation_page import simulation_page

        yield from simulation_page(result, document.get("sound"))

    def draw(self, case: CommandLine, result: ContactSimulation) -> Figure:
        from zwidth.show.figures.contact_response import contact_figure, draw_contact

        drawing, axes = contact_figure()
        draw_contact(axes, result.response)
        return drawing

    def write(
        self, case: CommandLine, result: ContactSimulation, document: dict[str, Any], reason: str | None
    ) -> str | None:
        if not case.writes(SOUND):
            return super().write(case, result, document, reason)
        from zwidth.show.sound import Silence, sound_of, write_sound

        assert case.path is not None
        try:
            sound = sound_of(result.response, case["sound_pitch"], case["sound_full_scale"])
        except Silence as error:
            del document["file"]
            return str(error)
        write_sound(case.path, sound)
        document["sound"] = sound.document()
        return reason


def _check_memory(case: CommandLine) -> None:
    """Raise TooLarge for more samples than there is memory for, with their text and a sound of a given pitch."""
    from zwidth.memory_limit import check_memory

    if case["duration"] is None:
        return
    samples = case["duration"] / case.device.controller.sampling_period
    runs = 1 if case["passivity_damping"] is None else 2
    pitch = case["sound_pitch"]
    sound = NUMBERS_OF_SOUND * case["duration"] / pitch if isinstance(pitch, float) else 0.0
    numbers = samples * (AS_TEXT + NUMBERS_PER_SAMPLE * runs) + sound
    check_memory(numbers, f"{samples:.4g} samples", "simulate a shorter time")
