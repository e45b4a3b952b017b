"""The springs of flexible drives under load: torque and tangent, on the branch on which they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zwidth.model.mechanism import Drives, Floats


@dataclass(frozen=True)
class DriveSprings:
    """Torque at the joint per deflection d, motor ahead of joint, of each drive (d,):

        k d + k_3 d^3             and, where the motor lags behind, d < 0, with another k

    forward, backward, hardening  k for either sign, and k_3, at the joint; forward is inf of rigid drives
    """

    forward: Floats
    backward: Floats
    hardening: Floats

    @classmethod
    def of(cls, drives: Drives) -> DriveSprings:
        """Of the drives of one design."""
        n = drives.transmission
        forward, dry = n**2 * drives.stiffness, drives.nonlinearity
        if dry is None:
            return cls(forward, forward, np.zeros(len(n)))
        given = np.isfinite(dry.backward_stiffness)
        backward = np.where(given, n**2 * np.where(given, dry.backward_stiffness, 0.0), forward)
        return cls(forward, backward, n**4 * dry.hardening)

    @property
    def flexible(self) -> NDArray[np.int64]:
        """Which drives are flexible."""
        return np.flatnonzero(np.isfinite(self.forward))

    @property
    def kinked(self) -> NDArray[np.bool_]:
        """(d,)  which drives change their stiffness at no torque."""
        return np.asarray(np.isfinite(self.forward) & (self.forward != self.backward))

    def torque(self, deflection: Floats) -> Floats:
        """Torques (d,) of deflections (d,), 0 of rigid drives."""
        k = np.where(deflection < 0.0, self.backward, self.forward)
        k = np.where(np.isfinite(self.forward), k, 0.0)
        return np.asarray(k * deflection + self.hardening * deflection**3)

    def tangent(self, deflection: Floats, backward: bool) -> Floats:
        """dT/dd (d,): k + 3 k_3 d^2, inf of rigid drives.

        backward  which branch is meant of a drive without torque
        """
        lags = (deflection < 0.0) | ((deflection == 0.0) & backward)
        return np.asarray(np.where(lags, self.backward, self.forward) + 3.0 * self.hardening * deflection**2)
