"""zwidth: which virtual walls a haptic device can render, what limits them, and what to change.

    import zwidth

    device = zwidth.load("my-device.toml", ["loop.delay_samples=1"])
    loop = zwidth.Loop(device.plant(at=(0.0, 0.25), direction=(0.0, 1.0)), device.controller)
    chart = zwidth.stability_chart(loop)
    chart.stiffness_max, chart.damping_at_stiffness_max, chart.frequencies_at_stiffness_max

Names are imported when they are first used, so that `import zwidth` stays quick.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from zwidth.chart.arc_joining import ChartError as ChartError
    from zwidth.chart.chart import BoundaryArc as BoundaryArc
    from zwidth.chart.chart import StabilityChart as StabilityChart
    from zwidth.chart.chart import largest_stiffness as largest_stiffness
    from zwidth.chart.chart import stability_chart as stability_chart
    from zwidth.chart.hysteretic import hysteretic_chart as hysteretic_chart
    from zwidth.chart.measured.chart import MeasuredChart as MeasuredChart
    from zwidth.chart.measured.chart import measured_chart as measured_chart
    from zwidth.chart.polar import largest_stiffness_by_direction as largest_stiffness_by_direction
    from zwidth.chart.robust.chart import RobustChart as RobustChart
    from zwidth.chart.robust.chart import robust_chart as robust_chart
    from zwidth.chart.several_directions.chart import MultiChart as MultiChart
    from zwidth.chart.several_directions.chart import multi_chart as multi_chart
    from zwidth.chart.verdict import eigenvalues as eigenvalues
    from zwidth.chart.verdict import judge as judge
    from zwidth.chart.verdict import spectral_radius as spectral_radius
    from zwidth.conditions.bound import Bound as Bound
    from zwidth.conditions.registry import compare as compare
    from zwidth.contact.environments import ENVIRONMENTS as ENVIRONMENTS
    from zwidth.contact.environments import load_environment as load_environment
    from zwidth.contact.environments.environment import Environment as Environment
    from zwidth.contact.environments.environment import Parameter as Parameter
    from zwidth.contact.environments.environment import environment as environment
    from zwidth.contact.hand import Hand as Hand
    from zwidth.contact.hand import Reach as Reach
    from zwidth.contact.hand import Reflex as Reflex
    from zwidth.contact.hand import Tremor as Tremor
    from zwidth.contact.limit_cycles import limit_cycles as limit_cycles
    from zwidth.contact.mechanism.reach import SurfaceOutOfReach as SurfaceOutOfReach
    from zwidth.contact.mechanism.simulate import MechanismMotion as MechanismMotion
    from zwidth.contact.mechanism.simulate import SurfaceWall as SurfaceWall
    from zwidth.contact.mechanism.simulate import simulate_mechanism as simulate_mechanism
    from zwidth.contact.mechanism.surfaces import Box as Box
    from zwidth.contact.mechanism.surfaces import Plane as Plane
    from zwidth.contact.mechanism.surfaces import Sphere as Sphere
    from zwidth.contact.passivity import PassivityController as PassivityController
    from zwidth.contact.response import TimeResponse as TimeResponse
    from zwidth.contact.simulate import Run as Run
    from zwidth.contact.simulate import simulate as simulate
    from zwidth.contact.simulate import simulate_batch as simulate_batch
    from zwidth.contact.verdict import judge_response as judge_response
    from zwidth.device.device import Device as Device
    from zwidth.device.faults import DeviceError as DeviceError
    from zwidth.device.load import from_document as from_document
    from zwidth.device.load import load as load
    from zwidth.device.load import schema as schema
    from zwidth.device.read import bundled as bundled
    from zwidth.guarantees.nested import nested as nested
    from zwidth.guarantees.passive import passive_region as passive_region
    from zwidth.guarantees.springs import spring_stable_region as spring_stable_region
    from zwidth.loop.controller import Butterworth as Butterworth
    from zwidth.loop.controller import Controller as Controller
    from zwidth.loop.controller import FirstOrder as FirstOrder
    from zwidth.loop.estimators import AlphaBeta as AlphaBeta
    from zwidth.loop.estimators import BackwardDifference as BackwardDifference
    from zwidth.loop.estimators import CentralDifference as CentralDifference
    from zwidth.loop.estimators import Foaw as Foaw
    from zwidth.loop.estimators import Kalman as Kalman
    from zwidth.loop.estimators import LeastSquaresSlope as LeastSquaresSlope
    from zwidth.loop.estimators import Levant as Levant
    from zwidth.loop.estimators import SavitzkyGolay as SavitzkyGolay
    from zwidth.loop.estimators import WindowedDifference as WindowedDifference
    from zwidth.loop.estimators.running import velocity_of as velocity_of
    from zwidth.loop.loop import Loop as Loop
    from zwidth.loop.multi import MultiLoop as MultiLoop
    from zwidth.loop.operating_point import OperatingPoint as OperatingPoint
    from zwidth.measures.catalogue import find_measure as find_measure
    from zwidth.measures.dexterity import dynamic_isotropy as dynamic_isotropy
    from zwidth.measures.dexterity import dynamic_manipulability as dynamic_manipulability
    from zwidth.measures.dexterity import handle_mass_isotropy as handle_mass_isotropy
    from zwidth.measures.dexterity import isotropy as isotropy
    from zwidth.measures.dexterity import isotropy_frobenius as isotropy_frobenius
    from zwidth.measures.dexterity import manipulability as manipulability
    from zwidth.measures.eigenvalue_paths import EigenvaluePaths as EigenvaluePaths
    from zwidth.measures.eigenvalue_paths import eigenvalue_paths as eigenvalue_paths
    from zwidth.measures.eigenvalue_paths import loop_paths as loop_paths
    from zwidth.measures.eigenvalue_paths import wall_paths as wall_paths
    from zwidth.measures.evaluate import evaluate as evaluate
    from zwidth.measures.felt import felt_impedance as felt_impedance
    from zwidth.measures.felt import static_stiffness as static_stiffness
    from zwidth.measures.felt_chart import felt_chart as felt_chart
    from zwidth.measures.fidelity import OptimalMass as OptimalMass
    from zwidth.measures.fidelity import decay_time as decay_time
    from zwidth.measures.fidelity import fastest_mass as fastest_mass
    from zwidth.measures.fidelity import optimal_mass as optimal_mass
    from zwidth.measures.forces import acceleration_along as acceleration_along
    from zwidth.measures.forces import force_along as force_along
    from zwidth.measures.forces import force_component as force_component
    from zwidth.measures.forces import friction_along as friction_along
    from zwidth.measures.forces import resolution_along as resolution_along
    from zwidth.measures.homogeneous import characteristic_length as characteristic_length
    from zwidth.measures.homogeneous import homogeneous_jacobian as homogeneous_jacobian
    from zwidth.measures.homogeneous import scaled_jacobian as scaled_jacobian
    from zwidth.measures.impedance_range import ImpedanceRange as ImpedanceRange
    from zwidth.measures.impedance_range import rigid_range as rigid_range
    from zwidth.measures.impedance_range import sprung_range as sprung_range
    from zwidth.measures.measure import Measure as Measure
    from zwidth.measures.measure import Measured as Measured
    from zwidth.measures.measure import MeasureError as MeasureError
    from zwidth.measures.measure import WantedWall as WantedWall
    from zwidth.measures.overall import Overall as Overall
    from zwidth.measures.overall import global_conditioning_index as global_conditioning_index
    from zwidth.measures.overall import global_isotropy_index as global_isotropy_index
    from zwidth.measures.overall import overall as overall
    from zwidth.measures.own import load_measures as load_measures
    from zwidth.measures.own import measure as measure
    from zwidth.measures.structural import deformation_ratio as deformation_ratio
    from zwidth.measures.structural import structural_distortion as structural_distortion
    from zwidth.model.directions import MultiPlant as MultiPlant
    from zwidth.model.directions import reduce_directions as reduce_directions
    from zwidth.model.effective import effective_parameters as effective_parameters
    from zwidth.model.modes import natural_frequencies as natural_frequencies
    from zwidth.model.nonlinear import Brake as Brake
    from zwidth.model.nonlinear import Counter as Counter
    from zwidth.model.nonlinear import Friction as Friction
    from zwidth.model.nonlinear import Nonlinear as Nonlinear
    from zwidth.model.nonlinear import Spring as Spring
    from zwidth.model.operator import Operator as Operator
    from zwidth.model.operator import OperatorError as OperatorError
    from zwidth.model.operator import attach as attach
    from zwidth.model.plant import LaggedDamper as LaggedDamper
    from zwidth.model.plant import Plant as Plant
    from zwidth.model.posture import PostureError as PostureError
    from zwidth.model.posture import solve_posture as solve_posture
    from zwidth.model.reduction import ModelError as ModelError
    from zwidth.model.reduction import reduce_mechanism as reduce_mechanism
    from zwidth.model.reduction import reduce_plant as reduce_plant
    from zwidth.model.response import Response as Response
    from zwidth.model.response import ResponseError as ResponseError
    from zwidth.model.sweep import sweep_response as sweep_response
    from zwidth.study.common_area import common_area as common_area
    from zwidth.study.plane import plane_of as plane_of
    from zwidth.study.requirement import parse_requirement as parse_requirement
    from zwidth.study.robust import RobustError as RobustError
    from zwidth.study.robust import robust_study as robust_study
    from zwidth.study.sensitivity import sensitivities as sensitivities
    from zwidth.study.store import Store as Store
    from zwidth.study.study_file import Study as Study
    from zwidth.study.study_file import read_study as read_study
    from zwidth.study.sweep import Sweep as Sweep
    from zwidth.study.sweep import sweep as sweep
    from zwidth.study.validity import validity as validity
    from zwidth.study.workspace import workspace_map as workspace_map

__version__ = "0.1.0"

_HOME = {
    "chart.arc_joining": ("ChartError",),
    "chart.chart": (
        "BoundaryArc",
        "StabilityChart",
        "largest_stiffness",
        "stability_chart",
    ),
    "chart.hysteretic": ("hysteretic_chart",),
    "chart.measured.chart": (
        "MeasuredChart",
        "measured_chart",
    ),
    "chart.polar": ("largest_stiffness_by_direction",),
    "chart.robust.chart": (
        "RobustChart",
        "robust_chart",
    ),
    "chart.several_directions.chart": (
        "MultiChart",
        "multi_chart",
    ),
    "chart.verdict": (
        "eigenvalues",
        "judge",
        "spectral_radius",
    ),
    "conditions.bound": ("Bound",),
    "conditions.registry": ("compare",),
    "contact.environments": (
        "ENVIRONMENTS",
        "load_environment",
    ),
    "contact.environments.environment": (
        "Environment",
        "Parameter",
        "environment",
    ),
    "contact.hand": (
        "Hand",
        "Reach",
        "Reflex",
        "Tremor",
    ),
    "contact.limit_cycles": ("limit_cycles",),
    "contact.mechanism.reach": ("SurfaceOutOfReach",),
    "contact.mechanism.simulate": (
        "MechanismMotion",
        "SurfaceWall",
        "simulate_mechanism",
    ),
    "contact.mechanism.surfaces": (
        "Box",
        "Plane",
        "Sphere",
    ),
    "contact.passivity": ("PassivityController",),
    "contact.response": ("TimeResponse",),
    "contact.simulate": (
        "Run",
        "simulate",
        "simulate_batch",
    ),
    "contact.verdict": ("judge_response",),
    "device.device": ("Device",),
    "device.faults": ("DeviceError",),
    "device.load": (
        "from_document",
        "load",
        "schema",
    ),
    "device.read": ("bundled",),
    "guarantees.nested": ("nested",),
    "guarantees.passive": ("passive_region",),
    "guarantees.springs": ("spring_stable_region",),
    "loop.controller": (
        "Butterworth",
        "Controller",
        "FirstOrder",
    ),
    "loop.estimators": (
        "AlphaBeta",
        "BackwardDifference",
        "CentralDifference",
        "Foaw",
        "Kalman",
        "LeastSquaresSlope",
        "Levant",
        "SavitzkyGolay",
        "WindowedDifference",
    ),
    "loop.estimators.running": ("velocity_of",),
    "loop.loop": ("Loop",),
    "loop.multi": ("MultiLoop",),
    "loop.operating_point": ("OperatingPoint",),
    "measures.catalogue": ("find_measure",),
    "measures.dexterity": (
        "dynamic_isotropy",
        "dynamic_manipulability",
        "handle_mass_isotropy",
        "isotropy",
        "isotropy_frobenius",
        "manipulability",
    ),
    "measures.eigenvalue_paths": (
        "EigenvaluePaths",
        "eigenvalue_paths",
        "loop_paths",
        "wall_paths",
    ),
    "measures.evaluate": ("evaluate",),
    "measures.felt": (
        "felt_impedance",
        "static_stiffness",
    ),
    "measures.felt_chart": ("felt_chart",),
    "measures.fidelity": (
        "OptimalMass",
        "decay_time",
        "fastest_mass",
        "optimal_mass",
    ),
    "measures.forces": (
        "acceleration_along",
        "force_along",
        "force_component",
        "friction_along",
        "resolution_along",
    ),
    "measures.homogeneous": (
        "characteristic_length",
        "homogeneous_jacobian",
        "scaled_jacobian",
    ),
    "measures.impedance_range": (
        "ImpedanceRange",
        "rigid_range",
        "sprung_range",
    ),
    "measures.measure": (
        "Measure",
        "MeasureError",
        "Measured",
        "WantedWall",
    ),
    "measures.overall": (
        "Overall",
        "global_conditioning_index",
        "global_isotropy_index",
        "overall",
    ),
    "measures.own": (
        "load_measures",
        "measure",
    ),
    "measures.structural": (
        "deformation_ratio",
        "structural_distortion",
    ),
    "model.directions": (
        "MultiPlant",
        "reduce_directions",
    ),
    "model.effective": ("effective_parameters",),
    "model.modes": ("natural_frequencies",),
    "model.nonlinear": (
        "Brake",
        "Counter",
        "Friction",
        "Nonlinear",
        "Spring",
    ),
    "model.operator": (
        "Operator",
        "OperatorError",
        "attach",
    ),
    "model.plant": (
        "LaggedDamper",
        "Plant",
    ),
    "model.posture": (
        "PostureError",
        "solve_posture",
    ),
    "model.reduction": (
        "ModelError",
        "reduce_mechanism",
        "reduce_plant",
    ),
    "model.response": (
        "Response",
        "ResponseError",
    ),
    "model.sweep": ("sweep_response",),
    "study.common_area": ("common_area",),
    "study.plane": ("plane_of",),
    "study.requirement": ("parse_requirement",),
    "study.robust": (
        "RobustError",
        "robust_study",
    ),
    "study.sensitivity": ("sensitivities",),
    "study.store": ("Store",),
    "study.study_file": ("Study", "read_study"),
    "study.sweep": ("Sweep", "sweep"),
    "study.validity": ("validity",),
    "study.workspace": ("workspace_map",),
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = ["__version__", *sorted(_MODULE_OF)]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"zwidth.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULE_OF})
