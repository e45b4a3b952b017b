"""Fig. 5.5: what the distance d of the base joints does to the largest stiffness of the rigid body.

Base joint 1, whose elbow points towards +x, sits at x = d/2, the other at -d/2; both elbows stay on their side, so
that the arms cross for d < 0. The rigid body's largest stiffness is 0.686 m/T^2 (5.4): over a line of positions it
varies as the effective mass does. The handle can be at (0, y) only while |d|/2 is within sqrt((L1 + L2)^2 - y^2).

Run `python -m gallery.fig_5_5_base_distance` to see the numbers.
"""

from __future__ import annotations

import numpy as np

from zwidth.device.device import Device
from zwidth.device.faults import DeviceError
from zwidth.device.load import load
from zwidth.model.posture import PostureError
from zwidth.model.reduction import effective_parameters

Y = 0.25
REACH = 0.147 + 0.199
farthest_by_geometry = 2.0 * float(np.sqrt(REACH**2 - Y**2))


def apart(distance: float) -> Device:
    """The five-bar with its base joints a distance d apart."""
    places = {"upper-right": distance / 2.0, "upper-left": -distance / 2.0}
    return load("five-bar", [(f"mechanism.links.{name}.origin_m", [x, 0.0, 0.0]) for name, x in places.items()])


def reaches(distance: float) -> bool:
    """Whether the handle gets to (0, 0.25) m; farther apart the arms do not even meet (DeviceError)."""
    try:
        apart(distance).posture((0.0, Y))
    except (PostureError, DeviceError):
        return False
    return True


def farthest(sign: float) -> float:
    """Largest |d| of this sign at which the position is still reached, to a tenth of a millimetre."""
    near, far = 0.4, 0.6
    while far - near > 1e-4:
        middle = 0.5 * (near + far)
        near, far = (middle, far) if reaches(sign * middle) else (near, middle)
    return sign * near


farthest_apart, farthest_crossed = farthest(1.0), farthest(-1.0)

crossed = apart(-0.2)
x = np.linspace(-0.13, 0.13, 53)
mass = np.array(
    [
        float(effective_parameters(crossed.mechanism, crossed.posture((at, Y)), crossed.direction()).rigid_mass)
        for at in x
    ]
)
ratio_of_stiffness = float(mass.max() / mass.min())


if __name__ == "__main__":
    print(f"reached for d from {farthest_crossed:.4f} to {farthest_apart:.4f} m")
    print(f"largest stiffness at d = -0.2 m varies by a factor of {ratio_of_stiffness:.3f}")
