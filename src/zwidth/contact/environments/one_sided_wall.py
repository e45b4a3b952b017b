"""The Kelvin-Voigt wall as one touches it: it acts inside only."""

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment


@environment(
    [
        Parameter("stiffness", "N/m", 1000.0, meaning="K"),
        Parameter("damping", "N s/m", 0.0, meaning="B, negative where the wall drives"),
        Parameter("no_pull", "", 0.0, switch=True, meaning="1: the wall never pulls the device inwards"),
    ],
    name="one-sided wall",
    surface=True,
)
def one_sided_wall(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Kelvin-Voigt wall that acts inside only.

        f = -(K x + B v)  for x > 0, else 0              (Colgate and Brown 1994's wall, second-hand)
        f = min(f, 0)     with no_pull

    On the way out the damper pulls once B |v| > K x. That is the law as charts have it. The force steps by B v at
    the surface.

    >>> one_sided_wall.function(1e-3, -2.0, 0.0, 1e-3, one_sided_wall.values(damping=1.0), None)
    1.0
    >>> one_sided_wall.function(1e-3, -2.0, 0.0, 1e-3, one_sided_wall.values(damping=1.0, no_pull=1), None)
    0.0
    """
    if not position > 0.0:
        return 0.0
    force = float(-(parameters[0] * position + parameters[1] * velocity))
    return min(force, 0.0) if parameters[2] > 0.0 else force
