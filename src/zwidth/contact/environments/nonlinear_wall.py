"""A wall whose spring hardens or softens with depth."""

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment


@environment(
    [
        Parameter("stiffness", "N/m", 1000.0, low=0.0, meaning="K, at the surface"),
        Parameter("cubic", "N/m^3", 1e8, meaning="K3; negative softens, and pulls beyond sqrt(-K/K3)"),
        Parameter("damping", "N s/m", 0.0, meaning="B"),
        Parameter("two_sided", "", 0.0, switch=True, meaning="1: acts outside too"),
    ],
    name="nonlinear wall",
    surface=True,
)
def nonlinear_wall(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Wall with a cubic spring.

        f = -(K x + K3 x^3 + B v)   for x > 0 (two-sided: everywhere)       (Duffing's spring)

    The slope K + 3 K3 x^2 is what a small motion about x meets; the linear charts hold for it. Stored energy
    K x^2/2 + K3 x^4/4. For a power x^n without damping take `hunt_crossley` with dissipation 0.

    >>> nonlinear_wall.function(1e-3, 0.0, 0.0, 1e-3, nonlinear_wall.values(), None)
    -1.1
    """
    if not position > 0.0 and parameters[3] == 0.0:
        return 0.0
    spring = (parameters[0] + parameters[1] * position * position) * position
    return float(-(spring + parameters[2] * velocity))
