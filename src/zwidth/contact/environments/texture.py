"""A wavy surface, felt by the force along it."""

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment


@environment(
    [
        Parameter("height", "m", 1e-4, low=0.0, meaning="h, from valley to crest"),
        Parameter("wavelength", "m", 2e-3, low=1e-6, meaning="L, from crest to crest"),
        Parameter("normal_force", "N", 2.0, low=0.0, meaning="N that presses on the surface"),
        Parameter("damping", "N s/m", 0.0, meaning="B while on it"),
        Parameter("length", "m", np.inf, low=0.0, endless=True, meaning="of the textured part"),
    ]
)
def texture(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Sinusoidal texture, from 0 to its length along the direction of motion.

        height  y(x) = (h/2) (1 - cos(2 pi x/L)),    f = -N dy/dx - B v = -N (pi h/L) sin(2 pi x/L) - B v

    (force in proportion to the slope: Minsky, Ouh-young, Steele, Brooks and Behensky, Feeling and seeing, I3D
    1990, p. 235-243, second-hand). The spring part stores N y(x); its steepest stiffness is 2 pi^2 N h/L^2, in a
    valley, and as steeply negative on a crest.

    >>> round(texture.function(0.5e-3, 0.0, 0.0, 1e-3, texture.values(), None), 6)
    -0.314159
    """
    if not 0.0 < position <= parameters[4]:
        return 0.0
    around = 2.0 * np.pi / parameters[1]
    slope = 0.5 * parameters[0] * around * np.sin(around * position)
    return float(-parameters[2] * slope - parameters[3] * velocity)
