"""`zwidth move`: a whole mechanism in motion.

Text page of a whole mechanism's motion.

Command-line options of `zwidth move`: the surface that the handle meets, and what drives the mechanism.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite, isnan
from typing import TYPE_CHECKING, Any, Final

from zwidth.errors import NoAnswerError
from zwidth.questions import MOVE
from zwidth.show.circumstances import computer_text
from zwidth.show.cli.answer import Row, answer_table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.contact_options import (
    ParameterType,
    environment_from_options,
    usage_error,
)
from zwidth.show.cli.errors import BadInput, as_option
from zwidth.show.cli.options import options_of
from zwidth.show.cli.simulate import environment_words
from zwidth.show.output import printable
from zwidth.show.units import HEADINGS, amount, energy_rows, percent, typed, vector

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.contact.mechanism.motion import MechanismMotion
    from zwidth.show.cli.command import CommandLine


if TYPE_CHECKING:
    from numpy.typing import NDArray

    from zwidth.contact.mechanism.simulate_mechanism import SurfaceRendering
    from zwidth.contact.mechanism.surfaces import Surface
    from zwidth.device.device import Device
    from zwidth.show.cli.options import Question

    Floats = NDArray[Any]

SURFACES: Final = ("plane", "sphere", "box")
WALL_OPTIONS: Final = ("stiffness", "damping", "no_pull", "two_sided", "hollow", "environment", "parameters")
STRONGEST: Final = 1e6  # N, largest push that is taken
FASTEST: Final = 1e3  # m/s, largest velocity at the start that is taken


def check_motion(options: Mapping[str, Any], question: Question) -> None:
    """Raise click.UsageError for options that cannot stand together."""
    given = [f"--{name}" for name in SURFACES if options[name] is not None]
    if len(given) > 1:
        raise usage_error(f"{' and '.join(given)} exclude each other: a motion meets one surface")
    _check_wall(options, given)
    _check_sizes(options)
    _check_question(options, question)


def _check_wall(options: Mapping[str, Any], surfaces: Sequence[str]) -> None:
    """Raise click.UsageError for options of the wall that do not fit the surface, or each other.

    surfaces  the option that gives the surface; none: ()
    """
    environment, plane, two_sided = options["environment"], options["plane"], options["two_sided"]
    if not surfaces:
        without_surface = [name for name in WALL_OPTIONS if options[name] not in (None, False, ())]
        if without_surface:
            raise usage_error(
                f"{_option_as_typed(without_surface[0])} needs a surface; add --plane, --sphere or --box"
            )
        return
    missing = [f"--{name}" for name in ("stiffness", "damping") if options[name] is None]
    if environment is None and missing:
        raise usage_error(f"{surfaces[0]} needs --stiffness and --damping; missing: {' and '.join(missing)}")
    if environment is None and options["parameters"]:
        raise usage_error("--parameter belongs to --environment; a wall has --stiffness and --damping")
    if environment is not None and two_sided:
        raise usage_error(
            "--two-sided and --environment exclude each other: an environment says itself on which sides it "
            "acts, as `--environment wall` does on both"
        )
    if two_sided and plane is None:
        raise usage_error("--two-sided goes with --plane; the side of a sphere or a box is chosen by --hollow")
    if options["hollow"] and plane is not None:
        raise usage_error("--hollow goes with --sphere or --box; reverse a plane by its normal")
    if two_sided and options["no_pull"]:
        raise usage_error("a two-sided plane always pulls; leave out --no-pull or --two-sided")


def _check_sizes(options: Mapping[str, Any]) -> None:
    """Raise click.UsageError for a push or velocity too large to be meant."""
    for name, limit, unit in (("push", STRONGEST, "N"), ("start_velocity", FASTEST, "m/s")):
        value = options[name] or ()
        if any(abs(part) > limit for part in value):
            numbers = ",".join(f"{part:g}" for part in value)
            raise usage_error(
                f"{_option_as_typed(name)}: must lie from -{limit:g} to {limit:g} {unit}, got {numbers}"
            )


def _check_question(options: Mapping[str, Any], question: Question) -> None:
    """Raise click.UsageError for a model, an operator or a direction that a motion has no use for."""
    if question.model not in (None, "full"):
        raise usage_error(
            f"the whole mechanism moves, so that --model {question.model} does not apply; leave out --model"
        )
    if question.operator not in (None, "none"):
        raise usage_error("no operator holds the mechanism here; leave out --operator and give a --push")
    along = [options["push"], options["start_velocity"]]
    if question.direction is not None and not any(value is not None and len(value) == 1 for value in along):
        one = "a --push or --start-velocity given as one number"
        raise usage_error(f"--direction is used only with {one}; give one, or leave out --direction")


def surface_option(options: Mapping[str, Any]) -> str:
    """The option that gave the surface; "" where none did."""
    return next((f"--{name}" for name in SURFACES if options[name] is not None), "")


def surface_of(options: Mapping[str, Any], device: Device) -> Surface | None:
    """What the handle meets. Points given by two numbers lie at the height of the device's reference position.

    Raises  BadInput  for numbers that describe none
    """
    from zwidth.contact.mechanism.surfaces import Box, Plane, Sphere, packed

    height = 0.0 if device.reference_position is None else float(device.reference_position[2])
    plane, sphere, box = (options[name] for name in SURFACES)
    surface: Surface | None = None
    if plane is not None:
        half = len(plane) // 2
        surface = Plane(_with_height(plane[:half], height), plane[half:], two_sided=options["two_sided"])
    elif sphere is not None:
        surface = Sphere(_with_height(sphere[:-1], height), sphere[-1], hollow=options["hollow"])
    elif box is not None:
        half = len(box) // 2
        surface = Box(_with_height(box[:half], height), box[half:], hollow=options["hollow"])
    try:
        packed(surface)
    except ValueError as error:
        raise BadInput(f"{surface_option(options)}: {error}") from None
    return surface


def moved_wall(options: Mapping[str, Any]) -> SurfaceRendering | None:
    """What the computer renders at the surface; None without one. Raises BadInput for an environment that cannot
    be."""
    from zwidth.contact.mechanism.simulate_mechanism import SurfaceEnvironment, SurfaceWall

    gains = {name: options[name] for name in ("stiffness", "damping", "no_pull")}
    if options["environment"] is not None:
        return SurfaceEnvironment(
            *environment_from_options(options["environment"], options["parameters"], **gains)
        )
    if surface_option(options):
        return SurfaceWall(**gains)
    return None


def components(value: tuple[float, ...] | None, direction: Floats) -> Sequence[float] | Floats | None:
    """A vector of two or three components as typed, or of one number along the direction; None where left out."""
    return value[0] * direction if value is not None and len(value) == 1 else value


def _with_height(numbers: Sequence[float], height: float) -> tuple[float, ...]:
    """A point with its height; one in a plane has that of the device."""
    return (*numbers, height) if len(numbers) == 2 else tuple(numbers)


def _option_as_typed(name: str) -> str:
    """The option of an argument as the command line spells it."""
    return "--parameter" if name == "parameters" else as_option(name)


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
    options = options_of(MOVE, parameters=ParameterType())
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
        """What every answer states, without an operator; operator and load of the file are left out."""
        # nobody holds the handle but by the push
        left_out = [OPERATOR] if case.device.operator is not None else []
        left_out += ["the load"] if case.device.load is not None else []
        return super().circumstances(case) | {"operator": None, "left_out": left_out}

    def compute(self, case: CommandLine) -> MechanismMotion:
        """The motion; what cannot be simulated becomes BadInput under the option's name.

        Raises  NoAnswerError  where it ends before a sample, or the environment gives no force
        """
        from zwidth.errors import ArgumentError, TooLarge

        device, name = case.device, case.question.name
        if device.mechanism is None:
            kind = "[plant]" if device.given_plant is not None else "[response]"
            raise BadInput(f"{name}: has a {kind} and no [mechanism] to move; `zwidth simulate` takes a [plant]")
        direction = device.direction(case.question.direction)
        surface, wall = surface_of(case.options, device), moved_wall(case.options)
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
        except ArgumentError as error:
            if error.argument == "surface":
                raise BadInput(f"{surface_option(case.options)}: {error.reasons[0]}") from None
            option = f"{as_option(error.argument)}: " if error.argument else ""
            raise BadInput(f"{name}: {option}{error.reasons[0]}") from None
        if not len(motion.time):
            raise NoAnswerError(motion.reason)
        if motion.status == "no force":
            raise NoAnswerError(f"{motion.reason}; have it return a number there")
        return motion

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages begin with where it starts

    def pages(self, case: CommandLine, result: MechanismMotion, document: Mapping[str, Any]) -> Iterator[Any]:

        return move_page(case, result, document)

    def draw(self, case: CommandLine, result: MechanismMotion) -> Figure:
        from zwidth.show.figures.mechanism_motion import draw_mechanism_motion, mechanism_motion_figure

        drawing, axes = mechanism_motion_figure()
        draw_mechanism_motion(axes, result)
        return drawing


def _check_memory(case: CommandLine) -> None:
    """Raise TooLarge for more samples than there is memory for, all that is shown as text included."""
    from zwidth.resources import check_memory

    samples = case["duration"] / case.device.controller.sampling_period
    of_sample, of_drive = NUMBERS_PER_SAMPLE
    numbers = of_sample + of_drive * len(case.point.drives.names)
    check_memory((1 + AS_TEXT) * samples * numbers, f"{samples:.4g} samples", "move for a shorter time")


FINE: Final = 4  # substeps that friction asks for, which switches within a step
ROUNDING_SHARE: Final = 1e-13  # share of the motion's size below which a length is rounding
NO_WAY: Final = 1e-9  # share of the largest motion below which there is none
ENCODER_EFFECTS: Final = ("encoder steps", "noise")


def move_page(case: CommandLine, motion: MechanismMotion, document: Mapping[str, Any]) -> Iterator[Any]:
    """The page of a motion: its input, how it ended, its numbers and energies, and remarks."""
    start = vector(motion.start.position, "m")
    yield f"{printable(case.device.name)}: the whole mechanism from {start}, assembly {document['assembly']}"
    yield computer_text(case.device.controller)
    yield _status_sentence(document)
    yield two_columns([*_circumstance_rows(case, motion), *_result_rows(motion, document)])
    yield answer_table(HEADINGS, list(_energy_table_rows(document["energy_book_J"])))
    yield from _remarks(case, motion, document)


def _status_sentence(document: Mapping[str, Any]) -> str:
    """Sentence on how long the motion lasted, or why it ended early."""
    if document["ended_because"] is None:
        return f"moved for {amount(document['duration_s'], 's')}"
    return f"ended early: {document['ended_because']}"


def _circumstance_rows(case: CommandLine, motion: MechanismMotion) -> Iterator[Row]:
    """Rows (label, value) on what a motion was given: surface, start, push, gravity and simulated time."""
    yield "surface", _surface_text(motion, named=case["environment"] is not None)
    moving = f"with {vector(motion.start_velocity, 'm/s')}" if motion.start_velocity.any() else "at rest"
    yield "start", moving
    yield "hand", f"pushes with {vector(motion.push[0], 'N')}" if motion.push.any() else "does not push"
    if motion.gravity.any():
        yield "gravity", vector(motion.gravity, "m/s²")
    steps = "step" if motion.substeps == 1 else "steps"
    samples = "sample" if len(motion.time) == 1 else "samples"
    length = f"{amount(float(motion.time[-1]), 's')}, {len(motion.time)} {samples}"
    yield "simulated", f"{length}, {motion.substeps} {steps} between them"


def _surface_text(motion: MechanismMotion, named: bool) -> str:
    """The surface and what is rendered there, in words.

    named  whether --environment names it; else it is a wall of stiffness and damping
    """
    from zwidth.contact.mechanism.surfaces import Plane, Sphere

    surface, environment = motion.surface, motion.environment
    if surface is None or environment is None:
        return "none: the motors are off"
    if isinstance(surface, Plane):
        sides = "two-sided plane" if motion.two_sided else "plane"
        place = f"{sides} through {vector(surface.point, 'm')}, normal {vector(surface.normal)}"
    else:
        hollow = "hollow " if surface.hollow else ""
        if isinstance(surface, Sphere):
            place = f"{hollow}sphere round {vector(surface.center, 'm')}, radius {amount(surface.radius, 'm')}"
        else:
            sizes = vector(surface.half_sizes, "m")
            place = f"{hollow}box round {vector(surface.center, 'm')}, half sizes {sizes}"
    parameters = motion.parameters
    if named:
        return f"{place}; {environment_words(environment, parameters)}"
    pulls = ", never pulls" if parameters.get("no_pull") else ""
    return f"{place}; {amount(parameters['stiffness'], 'N/m')}, {amount(parameters['damping'], 'N s/m')}{pulls}"


def _result_rows(motion: MechanismMotion, document: Mapping[str, Any]) -> Iterator[Row]:
    """Rows (label, value) on a motion's numbers: contact, limits, where the handle ends, and how far it went."""
    import numpy as np

    if motion.surface is not None:
        yield (
            "largest penetration",
            _with_time(document["largest_penetration_m"], "m", motion.penetration, motion.time),
        )
        yield "largest force", _with_time(document["largest_force_N"], "N", motion.force_size, motion.time)
        yield "in contact", f"{typed(percent(document['contact_share']))} of the samples"
        yield "torque limits", _torque_limit_text(motion)
        if isfinite(motion.point.controller.force_limit):
            yield "force limit", _share_text(document["force_limit_share"])
    size = float(np.max(np.abs(motion.position)))  # beside which rounding is seen
    yield "handle at the end", vector(_without_rounding(motion.position[-1], size), "m")
    path = float(np.sum(np.linalg.norm(np.diff(motion.position, axis=0), axis=1)))
    yield "path length", amount(path if path > ROUNDING_SHARE * size else 0.0, "m")


def _without_rounding(position: Any, size: float) -> Any:
    """A position (3,) [m] with 0 for coordinates that are rounding of `size`, the largest of the motion [m]."""
    import numpy as np

    return np.where(np.abs(position) > ROUNDING_SHARE * size, position, 0.0)


def _with_time(value: float, unit: str, course: Any, time: Any) -> str:
    """A largest value in words, with the time (samples,) [s] at which its `course` (samples,) is largest."""
    if not value > 0.0:
        return amount(0.0, unit)
    return f"{amount(value, unit)}, after {amount(float(time[course.argmax()]), 's')}"


def _torque_limit_text(motion: MechanismMotion) -> str:
    """How often each drive with a torque limit reached it."""
    limits = motion.mechanism.drives.torque_limit
    shares = [
        f"{printable(name)} {_share_text(share)}"
        for (name, share), limit in zip(motion.torque_limit_share.items(), limits, strict=True)
        if isfinite(limit)
    ]
    return "; ".join(shares) or "none in the file"


def _share_text(share: float) -> str:
    """How often a limit was reached, as a share of the samples."""
    return f"reached in {typed(percent(share))} of the samples" if share > 0.0 else "not reached"


def _energy_table_rows(book: Mapping[str, float]) -> Iterator[tuple[str, str, str]]:
    """Rows of the energy table, as `energy_rows`: what each part gave; stored in motion and bending drives last.

    book  `MechanismMotion.energy_book` [J]

    What is not known is the difference: the dampers, or, where a motor's work is not known, motors and dampers.
    """
    given = {"hand": book["hand"], "motors": book["motors"], "gravity": book["gravity"]}
    given["dry friction"] = book["friction"]
    if isnan(given["motors"]):
        known = given["hand"] + given["gravity"] + given["dry friction"]
        # the row keeps its place
        given = {"motors and dampers, by difference" if name == "motors" else name: x for name, x in given.items()}
        given["motors and dampers, by difference"] = book["stored"] - known
    else:
        given["dampers, by difference"] = book["dampers"]
    return energy_rows(given, book["stored"])


def _remarks(case: CommandLine, motion: MechanismMotion, document: Mapping[str, Any]) -> Iterator[str]:
    """Sentences on what is worth a remark, such as a start inside the wall or a push without effect."""
    import numpy as np

    travel = float(np.max(np.ptp(motion.position, axis=0)))
    still = not travel > ROUNDING_SHARE * float(np.max(np.abs(motion.position)))
    if motion.surface is not None and motion.started_inside:
        side = f"behind the {document['surface']['kind']}" if motion.two_sided else "inside the wall"
        yield f"starts {amount(float(motion.depth[0]), 'm')} {side}"
    effects = [name for name in case.device.linear_omissions if motion.counted or name not in ENCODER_EFFECTS]
    if effects:
        yield f"includes what a chart leaves out: {', '.join(effects)}"
    if "dry friction" in effects and motion.substeps < FINE:
        yield f"friction switches within a step: use --substeps {FINE} or more"
    if document["left_out"]:
        yield f"leaves out {', '.join(document['left_out'])}: the hand is only the push"
    if ineffective := _ineffective_push(motion):
        yield (
            f"{amount(ineffective, 'N')} of the push act at right angles to every motion of the handle, and have "
            "no effect"
        )
    if not (motion.push.any() or motion.start_velocity.any() or motion.gravity.any()) and still:
        yield "nothing moves the handle: give --push, --start-velocity or --gravity"
    elif motion.surface is not None and not document["contact_share"]:
        yield "the handle never touches the surface"


def _ineffective_push(motion: MechanismMotion) -> float:
    """How much of the push lies across all directions in which the handle can go [N]; 0 where none does."""
    import numpy as np

    push = motion.push[0]
    # the columns whose singular value is not 0 span the directions in which the handle moves
    along, sizes, _ = np.linalg.svd(motion.start.jacobian)
    ways = along[:, : len(sizes)][:, sizes > NO_WAY * sizes.max()]
    across = float(np.linalg.norm(push - ways @ (ways.T @ push)))
    return across if across > NO_WAY * float(np.linalg.norm(push)) else 0.0
