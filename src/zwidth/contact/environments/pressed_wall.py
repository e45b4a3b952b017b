"""The one-sided wall on which a hand leans: as one touches it about the haptic equilibrium."""

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment


@environment(
    [
        Parameter("stiffness", "N/m", 1000.0, meaning="K"),
        Parameter("damping", "N s/m", 0.0, meaning="B, negative where the wall drives"),
        Parameter("load", "N", 5.0, meaning="F, with which the hand leans on it along +y"),
        Parameter("no_pull", "", 0.0, switch=True, meaning="1: the wall never pulls the device inwards"),
    ],
    name="one-sided wall under load",
)
def pressed_wall(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Kelvin-Voigt wall that acts inside only, by how its force differs from that at the equilibrium.

        f = F - (F + K x + B v)  inside, where the depth x + F/K has the sign of F;   else F

    x is the way from the equilibrium, where wall and hand hold each other. Up to an amplitude of F/K it is the
    two-sided wall; beyond, the device leaves the wall and the hand's force alone is left. With no_pull the wall's
    own force never changes its sign.

    >>> values = pressed_wall.values(stiffness=1000.0, load=5.0)
    >>> [pressed_wall.function(x, 0.0, 0.0, 1e-3, values, None) for x in (0.001, -0.004, -0.02)]
    [-1.0, 4.0, 5.0]
    """
    K, B, F = parameters[0], parameters[1], parameters[2]
    if not (F + K * position) * F > 0.0:
        return float(F)
    pressed = F + K * position + B * velocity
    if parameters[3] > 0.0 and pressed * F < 0.0:
        pressed = 0.0
    return float(F - pressed)
