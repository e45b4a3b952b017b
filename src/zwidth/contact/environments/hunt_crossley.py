"""Contact whose damping grows with depth, so that force neither jumps at the surface nor pulls at slow speeds."""

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment


@environment(
    [
        Parameter("stiffness", "N/m^n", 3e4, low=0.0, meaning="K"),
        Parameter("exponent", "", 1.5, low=1.0, high=10.0, meaning="n; 1.5 is Hertz's sphere"),
        Parameter("dissipation", "s/m", 0.5, low=0.0, meaning="lambda"),
        Parameter("no_pull", "", 0.0, switch=True, meaning="1: the wall never pulls the device inwards"),
    ],
    name="Hunt-Crossley contact",
    surface=True,
)
def hunt_crossley(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Hunt and Crossley's contact.

        f = -K x^n (1 + lambda v)  for x > 0, else 0
        (Hunt and Crossley, J. Applied Mechanics 42 (1975) 440-445, second-hand; there K x^n + D x^n v, D =
        lambda K)

    The force starts from zero at the surface whatever the speed. It pulls where v < -1/lambda, a speed that a
    body leaving this contact never has, but a hand may.

    >>> hunt_crossley.function(0.01, 0.2, 0.0, 1e-3, hunt_crossley.values(), None)
    -33.0
    """
    if not position > 0.0:
        return 0.0
    force = float(-parameters[0] * position ** parameters[1] * (1.0 + parameters[2] * velocity))
    return min(force, 0.0) if parameters[3] > 0.0 else force
