"""zwidth: which virtual walls a haptic device can render, what limits them, and what to change.

    import zwidth

    device = zwidth.load("my-device.toml")            # or the name of a bundled one
    point = device.at((0.0, 0.25), (0.0, 1.0))        # handle position [m], rendered direction
    chart = point.chart()
    chart.stiffness_max, chart.frequencies_at_stiffness_max
    slower = device.with_({"loop.sampling_period_s": 0.002})

What most scripts need is here; the rest is in the packages `chart`, `conditions`, `contact`, `device`,
`guarantees`, `identify`, `loop`, `measures`, `model`, `show` and `study`. Names are imported when first used.
"""

from pathlib import Path
from typing import Any

import lazy_loader

from zwidth._version import __version__ as __version__

_named, _, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ += ["__version__"]


def __dir__() -> list[str]:
    return sorted(__all__)


def __getattr__(name: str) -> Any:
    """A name of `__all__`, imported now. Raises AttributeError for any other, with the package that has it."""
    if name in __all__:
        return _named(name)
    message = f"module 'zwidth' has no attribute {name!r}"
    if not name.startswith("_"):
        packages = [found.parent.name for found in Path(__file__).parent.glob("*/__init__.pyi")]
        homes = [package for package in packages if name in _named(package).__all__]
        message += "".join(f"; write zwidth.{package}.{name}" for package in homes)
    raise AttributeError(message)
