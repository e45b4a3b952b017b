"""`zwidth move`: a whole mechanism in motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.failures import NoAnswer
from zwidth.show.cli.moved import columns, facts, moved, numbers
from zwidth.show.cli.moved_pages import pages
from zwidth.show.cli.options import Question, about_a_device, as_json, example, output_option
from zwidth.show.cli.surface_options import Motion, about_a_motion
from zwidth.show.output import DATA, FIGURES, destination, write_data

if TYPE_CHECKING:
    from zwidth.show.cli.moved import Moved

KEYS: Final = (
    "surface",
    "environment",
    "parameters",
    "wall_stiffness_N_per_m",
    "wall_damping_Ns_per_m",
    "no_pull",
    "push_N",
    "start_velocity_m_per_s",
    "gravity_m_per_s2",
    "torque_limits",
    "encoders_counted",
    "substeps",
    "seed",
    "duration_asked_s",
    "duration_s",
    "status",
    "ended_because",
    "started_inside",
    "largest_penetration_m",
    "largest_force_N",
    "contact_share",
    "torque_limit_share",
    "force_limit_share",
    "energy_book_J",
    "time_s",
    "position_m",
    "counted_position_m",
    "depth_m",
    "force_N",
    "torque_Nm",
    "joint_rad",
    "motor_rad",
    "kinetic_J",
    "elastic_J",
    "gravitational_J",
    "hand_work_J",
    "motor_work_J",
    "friction_loss_J",
)


@click.command(
    short_help="Move the whole mechanism of DEVICE, against a surface or free.",
    epilog=example(
        "zwidth move my-arms.toml --plane 0,0.28,0,-1 --stiffness 2000 --damping 5 --push 0,2",
        "zwidth move my-arms.toml --sphere 0,0.3,0.05 --stiffness 900 --damping 3 --push 2 --output path.svg",
        "zwidth move my-arms.toml --plane 0,0.28,0,-1 --environment hunt_crossley --parameter dissipation=1",
    ),
)
@about_a_device
@about_a_motion
@output_option("Write a figure (.png .svg .pdf) or the data (.csv .json).")
@as_json
def move(question: Question, motion: Motion, output: str | None, as_json: bool) -> int:
    """Move the whole mechanism of DEVICE, free or against a surface: large motions, with all that bends, rubs and
    swings. The posture is where it starts; the hand is a push."""
    path = None if output is None else destination(output, FIGURES + DATA)
    device = question.device()
    if device.mechanism is None:
        kind = "[plant]" if device.given_plant is not None else "[response]"
        raise BadInput(
            f"{question.name}: has a {kind} and no [mechanism] to move; `zwidth simulate` takes a [plant]"
        )
    try:
        found = moved(question, device, motion)
    except NoAnswer as none:
        return deliver(Answer(facts(question, device) | dict.fromkeys(KEYS), reason=str(none)), as_json)
    document = facts(question, device) | numbers(found)
    if path is not None:
        document["file"] = str(path)
        _write(path, found, document)
    return deliver(Answer(document, lambda: list(pages(found, document))), as_json)


def _write(path: Path, found: Moved, document: dict[str, Any]) -> None:
    if path.suffix.lower() in DATA:
        write_data(path, document, columns(document))
        return
    from zwidth.show.figures.path import draw_path, path_figure
    from zwidth.show.figures.style import save

    drawing, axes = path_figure()
    draw_path(axes, found.mechanism, found.posture, found.motion, found.surface)
    save(drawing, path)
