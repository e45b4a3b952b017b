"""The friction-quantisation plane: what a device's two frictions have to pay for, and can.

    beta = b/(K T)        viscous friction, against the hold
    sigma = f_c/(K Delta) dry friction, against the encoder's step

(Diolaiti, Niemeyer, Barbagli and Salisbury 2006; Abbott and Okamura 2005). Of both papers the abstracts could be
read: that such regions exist, that many devices work outside the passive one, and that for one mass passivity
needs both. The passive quadrant is known at second hand; what the other regions are called and mean here is
derived.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.diolaiti import dimensionless_friction
from zwidth.conditions.traits import ground_friction, reading_step, traits
from zwidth.loop.controller import check_no_feedback, check_no_load
from zwidth.loop.loop import Loop

PASSIVE: Final = "passive"
SMALL: Final = "small vibrations"
LARGE: Final = "large vibrations"
BOTH: Final = "small and large vibrations"


@dataclass(frozen=True)
class DevicePlane:
    """A device's place in the plane, under pure springs.

    wall_stiffness  (k,)  K [N/m]
    beta, sigma     (k,)  along a ray through the origin, towards it the stiffer the wall
    regions         (k,)  one of

        passive                     beta >= l + 1/2 and sigma >= 1/2: nothing vibrates, whatever holds the device
        small vibrations            sigma < 1/2: there are pushes under which the device finds no place to rest,
                                    and hunts between two counts
        large vibrations            beta < l + 1/2: what dry friction stops while it is small grows once it is
                                    large, unless a hand or the structure takes the energy
        small and large vibrations  both

    delay           l [samples]: beta pays for (l + 1/2) T
    """

    wall_stiffness: Floats
    beta: Floats
    sigma: Floats
    regions: tuple[str, ...]
    delay: float


def plane_region(beta: float, sigma: float, delay_samples: float = 0.0) -> str:
    """The name of the region in which a point (beta, sigma) of the plane lies.

    >>> plane_region(0.6, 0.4), plane_region(0.1, 0.8), plane_region(0.6, 0.4, delay_samples=1)
    ('small vibrations', 'large vibrations', 'small and large vibrations')
    """
    viscous, dry = beta >= delay_samples + 0.5, sigma >= 0.5
    return PASSIVE if viscous and dry else SMALL if viscous else LARGE if dry else BOTH


def device_plane(
    loop: Loop,
    wall_stiffness: ArrayLike,
    coulomb_friction: float | None = None,
    resolution: float | None = None,
) -> DevicePlane:
    """A device in the plane, for each of some walls K > 0 [N/m], (k,).

    b is the friction of the free motion against the ground, f_c what all dry frictions together oppose to this
    motion, Delta the step of the reading when all encoders step, unless they are given.

    coulomb_friction  f_c [N];  resolution  Delta [m]
    Raises            FeedbackError  (loop.unsupported_feedback) for a computer with feedback beside the wall law,
                                     and for a load
                      ValueError   for a wall that is not positive; where the plant has no free motion, or
                                   neither it nor the arguments say what f_c and Delta are

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> loop = Loop(Plant(0.1 * one[:, None], 0.2 * one[:, None], 0.0 * one[:, None], one, one), Controller(0.001))
    >>> found = device_plane(loop, [200.0, 1000.0], coulomb_friction=0.004, resolution=2e-5)
    >>> found.beta.tolist(), found.sigma.tolist(), found.regions
    ([1.0, 0.2], [1.0, 0.2], ('passive', 'small and large vibrations'))
    """
    K = np.atleast_1d(np.asarray(wall_stiffness, dtype=float))
    if not np.all((K > 0.0) & np.isfinite(K)):
        raise ValueError(f"wall_stiffness must be positive and finite, got {wall_stiffness!r}")
    check_no_feedback(loop.controller, "the plane of friction and resolution is not known", "leave it out")
    check_no_load(loop.plant, "the plane of friction and resolution is not known", "leave the load out")
    own, delay = traits(loop), loop.controller.delay
    if np.isnan(own.ground_damping):
        raise ValueError(
            "the plane is drawn for a device that is free to move, and this one is tied to the ground"
        )
    friction = ground_friction(loop.plant) if coulomb_friction is None else coulomb_friction
    step = reading_step(loop.plant) if resolution is None else resolution
    if not friction >= 0.0:
        raise ValueError(f"coulomb_friction must not be negative, got {friction} N")
    if not step > 0.0:
        raise ValueError(f"the plane needs an encoder with steps, got a resolution of {step} m; give resolution")
    beta, sigma = dimensionless_friction(K, own.ground_damping, friction, loop.period, step)
    regions = tuple(plane_region(float(x), float(y), delay) for x, y in zip(beta, sigma, strict=True))
    return DevicePlane(K, beta, sigma, regions, delay)


def resting_limit(coulomb_friction: ArrayLike, resolution: ArrayLike) -> Floats:
    """Stiffest wall on which there is a place to rest under every constant push [N/m].

        K = 2 f_c/Delta

    At rest the wall's force is K n Delta with a whole n, whatever B, the delay and the filters are. Friction holds
    a mass under a push f where |f - K n Delta| <= f_c; over all f the nearest n leaves up to K Delta/2. Beyond the
    limit a push between two counts lets nothing rest: a limit cycle for certain. Below it every push can be rested
    under; it does not say that no vibration is sustained beside the state of rest (see docs/limit-cycles.md).

    coulomb_friction  (...)  f_c between wall and ground [N];  resolution  (...)  Delta [m], positive

    >>> float(resting_limit(0.1, 2e-5))
    10000.0
    """
    friction, step = np.asarray(coulomb_friction, dtype=float), np.asarray(resolution, dtype=float)
    if not np.all(step > 0.0):
        raise ValueError(f"resolution must be positive, got {resolution!r}")
    return np.asarray(2.0 * friction / step)


def quiet_limit(
    coulomb_friction: ArrayLike, resolution: ArrayLike, wall_damping: ArrayLike, sampling_period: ArrayLike
) -> Floats:
    """Stiffest wall, with a damping by differences of readings, that the encoder makes hunt in no way [N/m].

        K = 2 f_c/Delta - 2 |B|/T

    By harmonic balance between two counts: a vibration of any amplitude makes the reading jump by Delta, whose
    part at its own frequency is 2 Delta/pi; the wall and the hold turn this into a force that pushes with

        (2 Delta/pi) sin(t/2) (K - (2 B/T) cos t),     t = omega T,  largest where t = pi (for B >= 0)

    against 4 f_c/pi of dry friction. Both grow alike, so that no amplitude is needed. More delay only adds to the
    phase, viscous friction only helps. Compare K T/2 + |B| <= b of viscous friction (Colgate and Schenkel 1997).
    Derived here, for friction between wall and ground; sufficient, and often by far (docs/limit-cycles.md).

    coulomb_friction  (...)  f_c [N];  resolution  (...)  Delta [m], positive
    wall_damping      (...)  B [N s/m];  sampling_period  (...)  T [s]
    Returns           (...)  0 where no stiffness is left

    >>> float(quiet_limit(0.1, 2e-5, 1.0, 0.001))
    8000.0
    """
    B, T = np.asarray(wall_damping, dtype=float), np.asarray(sampling_period, dtype=float)
    return np.asarray(np.maximum(resting_limit(coulomb_friction, resolution) - 2.0 * np.abs(B) / T, 0.0))
