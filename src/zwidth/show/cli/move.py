"""`zwidth move`: a whole mechanism in motion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput, NoAnswer, as_option
from zwidth.show.cli.move_options import (
    check_motion,
    components,
    motion_options,
    surface_of,
    surface_option,
    wall_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.contact.mechanism.motion import MechanismMotion

OPERATOR: Final = "the operator"
AS_TEXT: Final = 6  # numbers' worth of memory that one takes as text
NUMBERS_PER_SAMPLE: Final = (17, 3)  # numbers shown of each sample, and as many more for each drive


class MoveCommand(Command):
    """Simulate the whole mechanism of DEVICE, free or against a surface: large motions, flexible drives, friction,
    gravity. It starts in the given posture; the hand is a force."""

    name = "move"
    takes_loads = False
    summary = "Simulate the whole mechanism of DEVICE, free or against a surface."
    examples = (
        "zwidth move my-arms.toml --plane 0,0.28,0,-1 --stiffness 2000 --damping 5 --push 0,2",
        "zwidth move my-arms.toml --sphere 0,0.3,0.05 --stiffness 900 --damping 3 --push 2 --output path.svg",
        "zwidth move my-arms.toml --plane 0,0.28,0,-1 --environment hunt_crossley --parameter dissipation=1",
    )
    options = motion_options()
    keys = (
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
    linear = False
    takes_responses = True  # which it refuses like every device without a mechanism

    def check(self, case: CommandLine) -> None:
        check_motion(case.options, case.question)

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        # nobody holds the handle but by the push
        left_out = [OPERATOR] if case.device.operator is not None else []
        left_out += ["the load"] if case.device.load is not None else []
        return super().circumstances(case) | {"operator": None, "left_out": left_out}

    def compute(self, case: CommandLine) -> MechanismMotion:
        from zwidth.contact.mechanism.motion_inputs import MotionError
        from zwidth.contact.mechanism.surface_reach import SurfaceOutOfReach
        from zwidth.memory_limit import TooLarge

        device, name = case.device, case.question.name
        if device.mechanism is None:
            kind = "[plant]" if device.given_plant is not None else "[response]"
            raise BadInput(f"{name}: has a {kind} and no [mechanism] to move; `zwidth simulate` takes a [plant]")
        direction = device.direction(case.question.direction)
        surface, wall = surface_of(case.options, device), wall_of(case.options)
        point = case.point
        try:
            _check_memory(case)
            motion = point.move(
                wall,
                surface,
                duration=case["duration"],
                start_velocity=components(case["start_velocity"], direction),
                push=components(case["push"], direction),
                gravity=components(case["gravity"], direction),
                substeps=case["substeps"],
                counted=not case["exact"],
                torque_limits=case["torque_limits"],
                seed=case["seed"],
                progress=case.progress,
            )
        except TooLarge as error:
            raise BadInput(f"--duration: {error}") from None
        except SurfaceOutOfReach as error:
            raise BadInput(f"{surface_option(case.options)}: {error}") from None
        except MotionError as error:
            option = f"{as_option(error.argument)}: " if error.argument else ""
            raise BadInput(f"{name}: {option}{error}") from None
        if not len(motion.time):
            raise NoAnswer(motion.reason)
        if motion.status == "no force":
            raise NoAnswer(f"{motion.reason}; have it return a number there")
        return motion

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages begin with where it starts

    def pages(self, case: CommandLine, result: MechanismMotion, document: Mapping[str, Any]) -> Iterator[Any]:
        from zwidth.show.cli.move_page import move_page

        return move_page(case, result, document)

    def draw(self, case: CommandLine, result: MechanismMotion) -> Figure:
        from zwidth.show.figures.mechanism_motion import draw_mechanism_motion, mechanism_motion_figure

        drawing, axes = mechanism_motion_figure()
        draw_mechanism_motion(axes, result)
        return drawing


def _check_memory(case: CommandLine) -> None:
    """Raise TooLarge for more samples than there is memory for, all that is shown as text included."""
    from zwidth.memory_limit import check_memory

    samples = case["duration"] / case.device.controller.sampling_period
    numbers = NUMBERS_PER_SAMPLE[0] + NUMBERS_PER_SAMPLE[1] * len(case.point.drives.names)
    check_memory((1 + AS_TEXT) * samples * numbers, f"{samples:.4g} samples", "move for a shorter time")
