"""Command-line options of `zwidth move`: the surface that the handle meets, and what drives the mechanism."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.contact_options import (
    LARGEST_FORCE,
    LARGEST_SEED,
    BoundedNumber,
    environment_from_options,
    environment_options,
    usage_error,
)
from zwidth.show.cli.errors import BadInput, as_option
from zwidth.show.cli.options import Finite, Numbers
from zwidth.study.boundary.points_file import LARGEST_WALL

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from zwidth.contact.mechanism.simulate_mechanism import SurfaceRendering
    from zwidth.contact.mechanism.surfaces import Surface
    from zwidth.device.device import Device
    from zwidth.show.cli.options import Question

    Floats = NDArray[Any]

SURFACES: Final = ("plane", "sphere", "box")
WALL_OPTIONS: Final = ("stiffness", "damping", "no_pull", "two_sided", "hollow", "environment", "parameters")
LONGEST: Final = 1e9  # s
FASTEST: Final = 1e3  # m/s


def check_motion(options: Mapping[str, Any], question: Question) -> None:
    """Raise click.UsageError for options that cannot stand together."""
    given = [f"--{name}" for name in SURFACES if options[name] is not None]
    if len(given) > 1:
        raise usage_error(f"{' and '.join(given)} exclude each other: a motion meets one surface")
    _check_wall(options, given)
    _check_sizes(options)
    _check_question(options, question)


def _check_wall(options: Mapping[str, Any], surfaces: Sequence[str]) -> None:
    environment, plane, two_sided = options["environment"], options["plane"], options["two_sided"]
    if not surfaces:
        alone = [name for name in WALL_OPTIONS if options[name] not in (None, False, ())]
        if alone:
            raise usage_error(f"{_option(alone[0])} needs a surface; add --plane, --sphere or --box")
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
    for name, most, unit in (("push", LARGEST_FORCE, "N"), ("start_velocity", FASTEST, "m/s")):
        value = options[name] or ()
        if any(abs(part) > most for part in value):
            numbers = ",".join(f"{part:g}" for part in value)
            raise usage_error(f"{_option(name)}: must lie from -{most:g} to {most:g} {unit}, got {numbers}")


def _check_question(options: Mapping[str, Any], question: Question) -> None:
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
    """What the handle meets. Numbers in a plane lie at the height of the device's reference.

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


def wall_of(options: Mapping[str, Any]) -> SurfaceRendering | None:
    """What the computer renders at the surface. Raises BadInput for an environment that cannot be."""
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


def motion_options() -> tuple[Callable[..., Any], ...]:
    """What a mechanism meets and what drives it, as options."""
    return (*_surface_options(), *_force_options(), *_run_options())


def _surface_options() -> list[Callable[..., Any]]:
    return [
        click.option(
            "--plane",
            type=Numbers("X,Y[,Z],NX,NY[,NZ]", (4, 6), "0,0.28,0,-1"),
            help="A wall behind a plane: a point of it [m], and the direction out of the wall.",
        ),
        click.option(
            "--sphere", type=Numbers("X,Y[,Z],R", (3, 4), "0,0.3,0.05"), help="A ball: its centre and radius [m]."
        ),
        click.option(
            "--box",
            type=Numbers("X,Y[,Z],HX,HY[,HZ]", (4, 6), "0,0.3,0.05,0.02"),
            help="A box along the axes: its centre and half sizes [m]; with two it has no end along z.",
        ),
        click.option("--two-sided", is_flag=True, help="The plane holds the handle from both sides."),
        click.option("--hollow", is_flag=True, help="The sphere or box keeps the handle in, not out."),
        click.option(
            "--stiffness",
            metavar="K",
            type=BoundedNumber("N/m", 0.0, LARGEST_WALL),
            help="Stiffness of the wall [N/m].",
        ),
        click.option("--damping", metavar="B", type=Finite(), help="Damping of the wall [Ns/m]."),
        *environment_options(),
        click.option("--no-pull", is_flag=True, help="The wall never pulls the handle in."),
    ]


def _force_options() -> list[Callable[..., Any]]:
    return [
        click.option(
            "--push",
            type=Numbers("F|FX,FY[,FZ]", (1, 2, 3), "2 or 0,2"),
            help="Force of the hand [N]; one number acts along the direction. Default: none.",
        ),
        click.option(
            "--start-velocity",
            type=Numbers("V|VX,VY[,VZ]", (1, 2, 3), "0.1 or 0,0.1"),
            help="Velocity of the handle at the start [m/s]; one number is along the direction. Default: at rest.",
        ),
        click.option(
            "--gravity", type=Numbers("GX,GY[,GZ]", (2, 3), "0,-9.81"), help="Gravity [m/s²]. Default: none."
        ),
        click.option(
            "--torque-limits",
            type=click.Choice(("each", "together")),
            default="each",
            help="Limit each motor by itself, or scale all together, so that the force keeps its direction. "
            "Default: each.",
        ),
    ]


def _run_options() -> list[Callable[..., Any]]:
    return [
        click.option(
            "--duration",
            metavar="S",
            type=BoundedNumber("s", 0.0, LONGEST, above=True),
            default=1.0,
            help="Simulated time [s]. Default: 1.",
        ),
        click.option(
            "--substeps",
            type=click.IntRange(1, 100_000),
            default=4,
            help="Integration steps per sample. Default: 4.",
        ),
        click.option(
            "--seed",
            type=click.IntRange(0, LARGEST_SEED),
            default=0,
            help="Seed of the encoders' noise. Default: 0.",
        ),
        click.option("--exact", is_flag=True, help="Ideal encoders: no steps, no noise."),
    ]


def _with_height(numbers: Sequence[float], height: float) -> tuple[float, ...]:
    """A point with its height; one in a plane has that of the device."""
    return (*numbers, height) if len(numbers) == 2 else tuple(numbers)


def _option(name: str) -> str:
    return "--parameter" if name == "parameters" else as_option(name)
