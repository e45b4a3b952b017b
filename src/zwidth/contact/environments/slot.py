"""Two walls that face each other, with room between."""

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment


@environment(
    [
        Parameter("width", "m", 5e-3, low=0.0, endless=True, meaning="w of the free room"),
        Parameter("stiffness", "N/m", 1000.0, low=0.0, meaning="K of both walls"),
        Parameter("damping", "N s/m", 0.0, meaning="B of both walls"),
        Parameter("no_pull", "", 0.0, switch=True, meaning="1: the walls never pull the device inwards"),
    ],
    surface=True,
)
def slot(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Slot between a wall at 0 and one at -width, each a one-sided Kelvin-Voigt wall.

        f = -(K d + B v),   d = x for x > 0,   d = x + w for x < -w,   f = 0 between

    Width inf leaves the wall at 0; width 0 is the wall to both sides, but for the point x = 0.

    >>> [slot.function(x, 0.0, 0.0, 1e-3, slot.values(), None) for x in (1e-3, -2e-3, -6e-3)]
    [-1.0, 0.0, 1.0]
    """
    width = parameters[0]
    if position > 0.0:
        depth = position
    elif position < -width:
        depth = position + width
    else:
        return 0.0
    force = float(-(parameters[1] * depth + parameters[2] * velocity))
    if parameters[3] > 0.0 and force * depth > 0.0:
        return 0.0
    return force
