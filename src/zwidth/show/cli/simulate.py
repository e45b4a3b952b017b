"""`zwidth simulate`: what happens on contact."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver
from zwidth.show.cli.contact_options import LARGEST_SEED, Bounded, Contact, about_a_contact
from zwidth.show.cli.failures import NoAnswer
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Question, about_a_device, as_json, example, output_option
from zwidth.show.cli.simulated import columns, numbers, simulated
from zwidth.show.cli.simulated_pages import pages
from zwidth.show.output import DATA, FIGURES, destination, write_data

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.show.cli.simulated import Simulated

SOUND: Final = (".wav",)
LONGEST: Final = 1e9  # s
KEYS: Final = (
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


@click.command(
    short_help="Simulate what happens when DEVICE touches a wall.",
    epilog=example(
        "zwidth simulate my-device.toml --stiffness 4000 --damping 10 --output motion.svg",
        "zwidth simulate my-device.toml --stiffness 4000 --damping 10 --wall one-sided --output heard.wav",
    ),
)
@about_a_device
@about_a_contact
@click.option(
    "--duration",
    metavar="S",
    type=Bounded("s", 0.0, LONGEST, above=True),
    help="How long [s]. Default: a tenfold change at the predicted rate, and at least eight periods, "
    "at most 60 s.",
)
@click.option(
    "--substeps",
    type=click.IntRange(1, 100_000),
    default=20,
    help="Steps between samples, for what is not linear. Default: 20.",
)
@click.option(
    "--seed", type=click.IntRange(0, LARGEST_SEED), default=0, help="Another noise of the encoders. Default: 0."
)
@click.option(
    "--passivity",
    "largest_damping",
    metavar="B",
    type=Bounded("Ns/m", 0.0, 1e15, above=True),
    help="Add a time-domain passivity controller, whose damper is at most B [Ns/m].",
)
@output_option("Write a figure (.png .svg .pdf), the data (.csv .json), or the handle's sound (.wav).")
@as_json
def simulate(
    question: Question,
    contact: Contact,
    duration: float | None,
    substeps: int,
    seed: int,
    largest_damping: float | None,
    output: str | None,
    as_json: bool,
) -> int:
    """Simulate what happens when DEVICE touches a wall: does the motion die away, grow, go round, or leave?"""
    path = None if output is None else destination(output, FIGURES + DATA + SOUND)
    device = question.device()
    if device.response is not None:
        return without_model(question, device, dict.fromkeys(KEYS), as_json)
    facts = question.circumstances(device)
    try:
        found = simulated(
            question,
            device,
            contact,
            duration=duration,
            substeps=substeps,
            seed=seed,
            largest_damping=largest_damping,
            trail=path is not None and path.suffix.lower() not in DATA,
            sound=path is not None and path.suffix.lower() in SOUND,
        )
    except NoAnswer as none:
        return deliver(Answer(facts | dict.fromkeys(KEYS), reason=str(none)), as_json)
    document = facts | numbers(found, seed)
    if found.substeps < substeps:
        needless = f"--substeps {substeps}: a linear device is exact with any number; {found.substeps} were taken"
        click.echo(needless, err=True)
    reason = None
    if path is not None:
        document["file"] = str(path)
        reason = _write(path, question, device, found, document)
    return deliver(Answer(document, lambda: list(pages(question, device, found, document)), reason), as_json)


def _write(
    path: Path, question: Question, device: Device, found: Simulated, document: dict[str, Any]
) -> str | None:
    """Write the file; returns why there is nothing to write, or None."""
    kind = path.suffix.lower()
    if kind in DATA:
        write_data(path, document, columns(document, found.response))
    elif kind in SOUND:
        return _write_sound(path, found, document)
    else:
        from zwidth.show.figures.motion import draw_motion, motion_figure
        from zwidth.show.figures.style import save

        drawing, axes = motion_figure()
        draw_motion(axes, found.response)
        save(drawing, path)
    return None


def _write_sound(path: Path, found: Simulated, document: dict[str, Any]) -> str | None:
    from zwidth.show.sound import Silence, sound_of, write_sound

    try:
        heard = sound_of(found.response)
    except Silence as error:
        del document["file"]
        return str(error)
    write_sound(path, heard)
    told: Mapping[str, Any] = {
        "seconds": heard.seconds,
        "speed": heard.speed,
        "frequency_Hz": heard.frequency,
        "repeats": heard.repeats,
    }
    document["sound"] = dict(told)
    return None
