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
    from zwidth.chart.region import ChartError as ChartError
    from zwidth.chart.verdict import eigenvalues as eigenvalues
    from zwidth.chart.verdict import judge as judge
    from zwidth.chart.verdict import spectral_radius as spectral_radius
    from zwidth.device.device import Device as Device
    from zwidth.device.faults import DeviceError as DeviceError
    from zwidth.device.load import from_document as from_document
    from zwidth.device.load import load as load
    from zwidth.device.load import schema as schema
    from zwidth.device.read import bundled as bundled
    from zwidth.loop.controller import Butterworth as Butterworth
    from zwidth.loop.controller import Controller as Controller
    from zwidth.loop.controller import FirstOrder as FirstOrder
    from zwidth.loop.estimators import AlphaBeta as AlphaBeta
    from zwidth.loop.estimators import BackwardDifference as BackwardDifference
    from zwidth.loop.estimators import CentralDifference as CentralDifference
    from zwidth.loop.estimators import Kalman as Kalman
    from zwidth.loop.estimators import LeastSquaresSlope as LeastSquaresSlope
    from zwidth.loop.estimators import SavitzkyGolay as SavitzkyGolay
    from zwidth.loop.estimators import WindowedDifference as WindowedDifference
    from zwidth.loop.loop import Loop as Loop
    from zwidth.measures.dexterity import dynamic_manipulability as dynamic_manipulability
    from zwidth.measures.dexterity import isotropy as isotropy
    from zwidth.measures.dexterity import manipulability as manipulability
    from zwidth.model.effective import effective_parameters as effective_parameters
    from zwidth.model.modes import natural_frequencies as natural_frequencies
    from zwidth.model.plant import Plant as Plant
    from zwidth.model.posture import PostureError as PostureError
    from zwidth.model.posture import solve_posture as solve_posture
    from zwidth.model.reduction import ModelError as ModelError
    from zwidth.model.reduction import reduce_mechanism as reduce_mechanism
    from zwidth.model.reduction import reduce_plant as reduce_plant

__version__ = "0.1.0"

_HOME = {
    "chart.chart": ("BoundaryArc", "StabilityChart", "largest_stiffness", "stability_chart"),
    "chart.region": ("ChartError",),
    "chart.verdict": ("eigenvalues", "judge", "spectral_radius"),
    "device.device": ("Device",),
    "device.faults": ("DeviceError",),
    "device.load": ("from_document", "load", "schema"),
    "device.read": ("bundled",),
    "loop.controller": ("Butterworth", "Controller", "FirstOrder"),
    "loop.estimators": (
        "AlphaBeta",
        "BackwardDifference",
        "CentralDifference",
        "Kalman",
        "LeastSquaresSlope",
        "SavitzkyGolay",
        "WindowedDifference",
    ),
    "loop.loop": ("Loop",),
    "measures.dexterity": ("dynamic_manipulability", "isotropy", "manipulability"),
    "model.effective": ("effective_parameters",),
    "model.modes": ("natural_frequencies",),
    "model.plant": ("Plant",),
    "model.posture": ("PostureError", "solve_posture"),
    "model.reduction": ("ModelError", "reduce_mechanism", "reduce_plant"),
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
