"""Ridges and grooves with straight flanks, felt by the force along them."""

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment


@environment(
    [
        Parameter("height", "m", 1e-4, low=0.0, meaning="h of a ridge"),
        Parameter("pitch", "m", 2e-3, low=1e-6, meaning="L, from ridge to ridge"),
        Parameter("flank", "", 0.1, low=1e-3, high=0.5, meaning="w, share of the pitch that one flank takes"),
        Parameter("normal_force", "N", 2.0, low=0.0, meaning="N that presses on the surface"),
        Parameter("length", "m", np.inf, low=0.0, endless=True, meaning="of the grating"),
    ]
)
def grating(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Grating of ridges with straight flanks, from 0 to its length along the direction of motion.

        f = -N h/(w L)  going up, the first w L of each pitch
            +N h/(w L)  going down, from L/2 to L/2 + w L;   else 0

    (force in proportion to the slope, as for `texture`: Minsky and others 1990, second-hand). The force jumps at
    the flanks' ends. It stores N times the height; a sample that falls beyond a flank loses or gains part of it.

    >>> values = grating.values()
    >>> [grating.function(x, 0.0, 0.0, 1e-3, values, None) for x in (1e-4, 5e-4, 1.1e-3)]
    [-1.0, 0.0, 1.0]
    """
    if not 0.0 < position <= parameters[4]:
        return 0.0
    place = position / parameters[1] % 1.0
    force = float(parameters[3] * parameters[0] / (parameters[2] * parameters[1]))
    if place < parameters[2]:
        return -force
    return force if 0.5 <= place < 0.5 + parameters[2] else 0.0
