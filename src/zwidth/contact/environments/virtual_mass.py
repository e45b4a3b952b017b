"""A mass that is felt everywhere, by a filtered estimate of the acceleration."""

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment

BEGUN, SPEED, ACCELERATION = range(3)


@environment(
    [
        Parameter("mass", "kg", 0.05, meaning="m; negative takes inertia away"),
        Parameter("cutoff", "Hz", 30.0, low=1e-3, endless=True, meaning="f_c of the acceleration's filter"),
    ],
    name="virtual mass",
)
def virtual_mass(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Virtual mass, felt everywhere.

        f = -m a,   a_j = a_{j-1} + (1 - E) ((v_j - v_{j-1})/T - a_{j-1}),   E = exp(-2 pi f_c T)

    The estimated velocity v is differenced and goes through a first-order low-pass of cutoff f_c, sampled as a
    held input; as a transfer function from v,

        f/v = -m (z - 1)/(z T) * (1 - E) z/(z - E)

    With cutoff inf there is no filter. A rigid device of mass M without damping and delay, its velocity by
    backward difference, is then stable for -M < m < 2 M: the second differences d of its position follow
    d_{j+1} = -(m/2M) (d_j + d_{j-1}). Delay lowers the limit (M-width: Colonnese and Okamura 2012, abstract only).

    >>> memory = np.zeros(8)
    >>> values = virtual_mass.values(mass=0.1, cutoff=np.inf)
    >>> [round(float(virtual_mass.function(0.0, v, 0.0, 1e-3, values, memory)), 6) for v in (0.0, 0.01, 0.03)]
    [0.0, -1.0, -2.0]
    """
    if memory[BEGUN] == 0.0:
        memory[BEGUN], memory[SPEED] = 1.0, velocity
        return 0.0
    share = 1.0 - np.exp(-2.0 * np.pi * parameters[1] * period)
    memory[ACCELERATION] += share * ((velocity - memory[SPEED]) / period - memory[ACCELERATION])
    memory[SPEED] = velocity
    return float(-parameters[0] * memory[ACCELERATION])
