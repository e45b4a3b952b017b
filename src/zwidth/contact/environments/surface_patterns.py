"""Environments without a wall: what is felt while the device moves along a surface, or anywhere.

texture          a wavy surface, felt by the force along it
grating          ridges and grooves with straight flanks, felt by the force along them
friction_patch   a patch that one rubs over: sticking by a spring whose anchor slips
virtual_mass     a mass that is felt everywhere, by a filtered estimate of the acceleration

Arguments of each: position [m], positive inside or along the surface, estimated velocity [m/s], time and period
[s], parameters in the order in which they are declared, memory (8,). It returns the force on the device [N]; see
`Environment`.
"""

from __future__ import annotations

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
    height, wavelength, normal_force = parameters[0], parameters[1], parameters[2]
    damping, length = parameters[3], parameters[4]
    if not 0.0 < position <= length:
        return 0.0
    around = 2.0 * np.pi / wavelength
    slope = 0.5 * height * around * np.sin(around * position)
    return float(-normal_force * slope - damping * velocity)


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
    height, pitch, flank = parameters[0], parameters[1], parameters[2]
    normal_force, length = parameters[3], parameters[4]
    if not 0.0 < position <= length:
        return 0.0
    place = position / pitch % 1.0
    force = float(normal_force * height / (flank * pitch))
    if place < flank:
        return -force
    return force if 0.5 <= place < 0.5 + flank else 0.0


# Places in the memory: 1 while on the patch, last position, stretch x - w of the spring, 1 while sliding.
INSIDE, LAST, STRETCH, SLIDING = range(4)


@environment(
    [
        Parameter("friction", "N", 1.0, low=0.0, meaning="C, while sliding"),
        Parameter("breakaway", "", 1.0, low=1.0, high=10.0, meaning="rho, force that sticks at most over C"),
        Parameter("stiffness", "N/m", 2000.0, low=1e-3, meaning="K of the spring while sticking"),
        Parameter("length", "m", np.inf, low=0.0, endless=True, meaning="of the patch"),
    ],
    name="dry friction patch",
)
def friction_patch(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Patch with dry friction, from 0 to its length along the direction of motion.

        f = -K (x - w)     while it sticks, |f| <= rho C
        f = -C sign        while it slides; the anchor w is dragged behind at the distance C/K

    (the spring with a slipping anchor, the simplest of Hayward and Armstrong's displacement-based frictions,
    Experimental Robotics VI (2000), second-hand). It slides from the sample at which the spring would exceed rho
    C, and sticks again when the motion turns. No velocity is needed. On entry the anchor is where the device is,
    so that the force starts from zero. A slow stroke of amplitude A > C/K and back takes 4 C (A - C/K) with rho
    = 1.

    >>> memory, values = np.zeros(8), friction_patch.values()
    >>> [round(friction_patch.function(x, 0.0, 0.0, 1e-3, values, memory), 6) for x in (1e-4, 5e-4, 3e-3)]
    [-0.0, -0.8, -1.0]
    """
    friction, breakaway, stiffness, length = parameters[0], parameters[1], parameters[2], parameters[3]
    if not 0.0 < position <= length:
        memory[INSIDE], memory[SLIDING] = 0.0, 0.0
        return 0.0
    if memory[INSIDE] == 0.0:
        memory[INSIDE], memory[STRETCH], memory[LAST] = 1.0, 0.0, position
    stretch = memory[STRETCH] + position - memory[LAST]
    longest = friction / stiffness
    # C/K while it slides; rho C/K, at which it breaks away, while it sticks
    if abs(stretch) > (longest if memory[SLIDING] > 0.0 else breakaway * longest):
        stretch = np.sign(stretch) * longest
        memory[SLIDING] = 1.0
    elif abs(stretch) < longest:
        memory[SLIDING] = 0.0
    memory[STRETCH], memory[LAST] = stretch, position
    return float(-stiffness * stretch)


# Places in the memory: 1 after the first sample, last velocity, filtered acceleration.
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
    mass, cutoff = parameters[0], parameters[1]
    share = 1.0 - np.exp(-2.0 * np.pi * cutoff * period)
    memory[ACCELERATION] += share * ((velocity - memory[SPEED]) / period - memory[ACCELERATION])
    memory[SPEED] = velocity
    return float(-mass * memory[ACCELERATION])
