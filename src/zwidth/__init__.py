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
    from zwidth.chart.chart import BoundaryArc as BoundaryArc
    from zwidth.chart.chart import StabilityChart as StabilityChart
    from zwidth.chart.chart import largest_stiffness as largest_stiffness
    from zwidth.chart.chart import stability_chart as stability_chart
    from zwidth.chart.eigenloci import MultiChart as MultiChart
    from zwidth.chart.eigenloci import multi_chart as multi_chart
    from zwidth.chart.hysteretic import hysteretic_chart as hysteretic_chart
    from zwidth.chart.measured import MeasuredChart as MeasuredChart
    from zwidth.chart.measured import measured_chart as measured_chart
    from zwidth.chart.polar import largest_stiffness_by_direction as largest_stiffness_by_direction
    from zwidth.chart.region import ChartError as ChartError
    from zwidth.chart.robust import RobustChart as RobustChart
    from zwidth.chart.robust import robust_chart as robust_chart
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
    from zwidth.measures.dexterity import dynamic_manipulability as dynamic_manipulability
    from zwidth.measures.dexterity import isotropy as isotropy
    from zwidth.measures.dexterity import manipulability as manipulability
    from zwidth.measures.felt import felt_impedance as felt_impedance
    from zwidth.measures.felt import static_stiffness as static_stiffness
    from zwidth.measures.felt_chart import felt_chart as felt_chart
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
    from zwidth.study.robust import RobustError as RobustError
    from zwidth.study.robust import robust_study as robust_study
    from zwidth.study.sensitivity import sensitivities as sensitivities
    from zwidth.study.validity import validity as validity

__version__ = "0.1.0"

_HOME = {
    "chart.chart": (
        "BoundaryArc",
        "StabilityChart",
        "largest_stiffness",
        "stability_chart",
    ),
    "chart.eigenloci": (
        "MultiChart",
        "multi_chart",
    ),
    "chart.hysteretic": ("hysteretic_chart",),
    "chart.measured": (
        "MeasuredChart",
        "measured_chart",
    ),
    "chart.polar": ("largest_stiffness_by_direction",),
    "chart.region": ("ChartError",),
    "chart.robust": (
        "RobustChart",
        "robust_chart",
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
    "measures.dexterity": (
        "dynamic_manipulability",
        "isotropy",
        "manipulability",
    ),
    "measures.felt": (
        "felt_impedance",
        "static_stiffness",
    ),
    "measures.felt_chart": ("felt_chart",),
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
    "study.robust": (
        "RobustError",
        "robust_study",
    ),
    "study.sensitivity": ("sensitivities",),
    "study.validity": ("validity",),
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
