"""`zwidth simulate`: what happens on contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.command import Case, Command
from zwidth.show.cli.contact_options import (
    LARGEST_SEED,
    Bounded,
    check_contact,
    contact_arguments,
    contact_faults,
    contact_options,
)
from zwidth.show.output import DATA, FIGURES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.contact.contact_simulation import ContactSimulation

SOUND: Final = (".wav",)
LONGEST: Final = 1e9  # s
TRACED: Final = 17  # numbers kept of each sample
AS_TEXT: Final = 49  # numbers' worth of memory that each sample takes as text


class Simulate(Command):
    """Simulate what happens when DEVICE touches a wall: does the motion die away, grow, go round, or leave?"""

    name = "simulate"
    summary = "Simulate what happens when DEVICE touches a wall."
    examples = (
        "zwidth simulate my-device.toml --stiffness 4000 --damping 10 --output motion.svg",
        "zwidth simulate my-device.toml --stiffness 4000 --damping 10 --wall one-sided --output heard.wav",
    )
    options = (
        *contact_options(),
        click.option(
            "--duration",
            metavar="S",
            type=Bounded("s", 0.0, LONGEST, above=True),
            help="How long [s]. Default: a tenfold change at the predicted rate, and at least eight periods, "
            "at most 60 s.",
        ),
        click.option(
            "--substeps",
            type=click.IntRange(1, 100_000),
            default=20,
            help="Steps between samples, for what is not linear. Default: 20.",
        ),
        click.option(
            "--seed",
            type=click.IntRange(0, LARGEST_SEED),
            default=0,
            help="Another noise of the encoders. Default: 0.",
        ),
        click.option(
            "--passivity",
            "passivity_damping",
            metavar="B",
            type=Bounded("Ns/m", 0.0, 1e15, above=True),
            help="Add a time-domain passivity controller, whose damper is at most B [Ns/m].",
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

    def check(self, case: Case) -> None:
        check_contact(case.options)

    def compute(self, case: Case) -> ContactSimulation:
        from zwidth.contact.simulate_contact import simulate_contact
        from zwidth.show.sound import seconds_to_hear

        own = ("duration", "substeps", "seed", "passivity_damping")
        with contact_faults():
            _check_room(case)
            found = simulate_contact(
                case.point,
                **contact_arguments(case.options),
                **{name: case[name] for name in own},
                trail=case.writes(FIGURES + SOUND),
                seconds_to_hear=seconds_to_hear if case.writes(SOUND) else None,
            )
        if found.substeps < case["substeps"]:
            exact = f"a linear device is exact with any number; {found.substeps} were taken"
            click.echo(f"--substeps {case['substeps']}: {exact}", err=True)
        return found

    def pages(self, case: Case, result: ContactSimulation, document: Mapping[str, Any]) -> Iterator[Any]:
        from zwidth.show.cli.simulation_page import page

        yield from page(result, document.get("sound"))

    def draw(self, case: Case, result: ContactSimulation) -> Figure:
        from zwidth.show.figures.motion import draw_motion, motion_figure

        drawing, axes = motion_figure()
        draw_motion(axes, result.response)
        return drawing

    def write(
        self, case: Case, result: ContactSimulation, document: dict[str, Any], reason: str | None
    ) -> str | None:
        if not case.writes(SOUND):
            return super().write(case, result, document, reason)
        from zwidth.show.sound import Silence, sound_of, write_sound

        assert case.path is not None
        try:
            heard = sound_of(result.response)
        except Silence as error:
            del document["file"]
            return str(error)
        write_sound(case.path, heard)
        document["sound"] = {
            "seconds": heard.seconds,
            "speed": heard.speed,
            "frequency_Hz": heard.frequency,
            "repeats": heard.repeats,
        }
        return reason


def _check_room(case: Case) -> None:
    """Raise TooLarge for more samples than there is memory for, all that is shown as text included."""
    from zwidth.contact.room import check_room

    if case["duration"] is None:
        return
    samples = case["duration"] / case.device.controller.sampling_period
    runs = 1 if case["passivity_damping"] is None else 2
    check_room(samples * (AS_TEXT + TRACED * runs), f"{samples:.4g} samples", "simulate a shorter time")
