"""Names of the release 0.1.0 that still work for one release, with a warning that says what to write instead.

No other module has two names for one thing. To be removed with the release after the next.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from zwidth.device.device import Device
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.model.plant import Plant
    from zwidth.model.posture import Posture

# Package -> names that moved there from the top.
MOVED: Final = {
    "chart": (
        "BoundaryArc eigenvalues hysteretic_chart measured_chart MeasuredChart multi_chart MultiChart RobustChart "
        "spectral_radius"
    ),
    "conditions": "Bound compare",
    "contact": (
        "Box Environment ENVIRONMENTS Hand judge_response limit_cycles load_environment MechanismMotion "
        "PassivityController Plane Reach Reflex Run simulate simulate_batch Sphere "
        "SurfaceOutOfReach SurfaceWall TimeResponse Tremor"
    ),
    "guarantees": "passive_region spring_stable_region",
    "loop": (
        "AlphaBeta BackwardDifference CentralDifference Foaw Kalman LeastSquaresSlope Levant MultiLoop "
        "SavitzkyGolay velocity_of WindowedDifference"
    ),
    "measures": (
        "acceleration_along characteristic_length decay_time deformation_ratio dynamic_isotropy "
        "dynamic_manipulability eigenvalue_paths EigenvaluePaths evaluate fastest_mass felt_chart felt_impedance "
        "force_along force_component friction_along global_conditioning_index global_isotropy_index "
        "handle_mass_isotropy homogeneous_jacobian ImpedanceRange isotropy isotropy_frobenius loop_paths "
        "manipulability optimal_mass OptimalMass Overall overall resolution_along rigid_range "
        "scaled_jacobian sprung_range static_stiffness structural_distortion wall_paths"
    ),
    "model": (
        "attach Brake Counter effective_parameters Friction LaggedDamper MultiPlant natural_frequencies Nonlinear "
        "reduce_directions reduce_mechanism reduce_plant solve_posture Spring"
    ),
    "study": "common_area parse_requirement plane_of RobustError Store Study Sweep",
}


def old_name(name: str) -> Any:
    """The object that an old name of the top module means today.

    Warns   DeprecationWarning  with the name to write instead
    Raises  AttributeError      for a name that the top module never had
    """
    package = _package_of(name)
    if package is not None:
        _warn(f"zwidth.{name}", f"zwidth.{package}.{name}")
        return getattr(import_module(f"zwidth.{package}"), name)
    if name in REPLACED:
        instead, replacement = REPLACED[name]
        _warn(f"zwidth.{name}", instead)
        return replacement()
    raise AttributeError(f"module 'zwidth' has no attribute {name!r}")


def old_names() -> list[str]:
    """All old names that still work, in alphabetical order."""
    return sorted([*REPLACED, *(name for names in MOVED.values() for name in names.split())])


def _package_of(name: str) -> str | None:
    """The package to which a name of the top module moved; None if it did not."""
    return next((package for package, names in MOVED.items() if name in names.split()), None)


def _warn(old: str, new: str, depth: int = 4) -> None:
    """Warn at the line of the script that uses the old name, which is `depth` calls above `warnings.warn`."""
    warnings.warn(f"{old} goes with the next release; write {new}", DeprecationWarning, stacklevel=depth)


def sweep_of_study(study: Any, *more: Any) -> Any:
    """Result of `zwidth.sweep(study)`, from before it took a device and axes. Warns DeprecationWarning."""
    from zwidth.study.designs.sweep import run_study

    _warn("zwidth.sweep(study)", "zwidth.run_study(study)", 5)
    return run_study(study, *(one for one in more if one))


def plant_of(
    device: Device,
    at: Any = None,
    direction: Any = None,
    assembly: str | None = None,
    model: str | None = None,
    *,
    held: bool = True,
) -> Plant:
    """Result of `device.plant(...)`, from before there were operating points. Warns DeprecationWarning."""
    _warn("device.plant(...)", "device.at(...).plant, or .ungripped_plant", 5)
    point = device.at(at, direction, assembly=assembly, model=model)
    return point.plant if held else point.ungripped_plant


def posture_of(device: Device, at: Any = None, assembly: str | None = None) -> Posture:
    """Result of `device.posture(...)`, from before there were operating points. Warns DeprecationWarning."""
    _warn("device.posture(...)", "device.at(...).posture", 5)
    posture = device.at(at, assembly=assembly).posture
    assert posture is not None
    return posture


def _operating_point() -> Any:
    from zwidth.loop.operating_point import OperatingPoint

    return OperatingPoint


def _wanted_wall() -> Any:
    from zwidth.measures.definition import WantedWall

    return WantedWall


def _measure_values() -> Any:
    from zwidth.measures.definition import MeasureValues

    return MeasureValues


def _find_guarantees() -> Any:
    from zwidth.guarantees.loop_guarantees import find_guarantees

    return find_guarantees


def _place_of(
    device: Device,
    positions: ArrayLike | None = None,
    direction: Sequence[float] | None = None,
    assembly: str | None = None,
    model: str | None = None,
) -> OperatingPoint:
    """As `Device.at`."""
    return device.at(positions, direction, assembly=assembly, model=model)


def _sensitivities(
    device: Device,
    at: Any = None,
    direction: Sequence[float] | None = None,
    assembly: str | None = None,
    model: str | None = None,
) -> Any:
    """As `Device.sensitivities`."""
    return device.sensitivities(device.at(at, direction, assembly=assembly, model=model))


def _validity(
    device: Device,
    at: Any = None,
    direction: Sequence[float] | None = None,
    assembly: str | None = None,
    tolerance: float = 0.1,
) -> Any:
    """As `study.validity`."""
    from zwidth.study.validity import validity

    return validity(device.at(at, direction, assembly=assembly), tolerance)


def _largest_stiffness_by_direction(
    mechanism: Any, posture: Any, directions: ArrayLike, controller: Any, model: Any, damping: Any
) -> Any:
    """As `chart.largest_stiffness_by_direction` of an operating point."""
    import numpy as np

    from zwidth.chart.polar import largest_stiffness_by_direction
    from zwidth.loop.operating_point import OperatingPoint

    point = OperatingPoint(controller, mechanism, posture, np.eye(3)[:1], model=model, damping=damping)
    return largest_stiffness_by_direction(point, directions)


def _simulate_mechanism(
    mechanism: Any,
    damping: Any,
    controller: Any,
    wall: Any = None,
    surface: Any = None,
    *,
    at: ArrayLike | None = None,
    assembly: str | None = None,
    encoders: Any = "motor",
    **more: Any,
) -> Any:
    """As `contact.simulate_mechanism` of an operating point."""
    import numpy as np

    from zwidth.contact.mechanism.simulate_mechanism import simulate_mechanism
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.model.posture import solve_posture

    posture = solve_posture(mechanism, mechanism.reference_position if at is None else at, assembly)
    point = OperatingPoint(controller, mechanism, posture, np.eye(3)[:1], damping=damping, encoders=encoders)
    return simulate_mechanism(point, wall, surface, **more)


# Old name -> what to write instead, and a function that returns the object it still names.
REPLACED: Final[dict[str, tuple[str, Callable[[], Any]]]] = {
    "Place": ("zwidth.OperatingPoint", _operating_point),
    "Wanted": ("zwidth.measures.WantedWall", _wanted_wall),
    "Measured": ("zwidth.measures.MeasureValues", _measure_values),
    "nested": ("zwidth.guarantees.find_guarantees", _find_guarantees),
    "place_of": ("device.at(position, direction)", lambda: _place_of),
    "sensitivities": ("device.sensitivities(device.at(...))", lambda: _sensitivities),
    "validity": ("zwidth.study.validity(device.at(...))", lambda: _validity),
    "simulate_mechanism": ("device.at(position).move(wall, surface)", lambda: _simulate_mechanism),
    "largest_stiffness_by_direction": (
        "zwidth.chart.largest_stiffness_by_direction(device.at(...), directions)",
        lambda: _largest_stiffness_by_direction,
    ),
}
