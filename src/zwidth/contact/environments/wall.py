"""The Kelvin-Voigt wall to both sides: the linear wall of all charts."""

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment


@environment(
    [
        Parameter("stiffness", "N/m", 1000.0, meaning="K"),
        Parameter("damping", "N s/m", 0.0, meaning="B, negative where the wall drives"),
    ],
    linear=True,
)
def wall(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Kelvin-Voigt wall that holds to both sides.

        f = -(K x + B v)                                                (thesis, sec. 2.2; docs/conventions.md)

    >>> values, memory = wall.values(stiffness=2000.0, damping=1.0), [0.0] * 8
    >>> wall.function(0.001, 0.1, 0.0, 1e-3, values, memory)
    -2.1
    """
    return float(-(parameters[0] * position + parameters[1] * velocity))
