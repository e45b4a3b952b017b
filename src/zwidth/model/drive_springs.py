"""The springs of flexible drives under load: torque and tangent, on the branch on which they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.model.drive_nonlinearity import kinks
from zwidth.model.mechanism import Drives


@dataclass(frozen=True)
class DriveSprings:
    """Torque at the joint per deflection d, motor ahead of joint, of each drive (d,):

        k d + k_3 d^3             and, where the motor lags behind by more than d_k, another k

    forward, backward, hardening  k for either sign, and k_3, at the joint; forward is inf of rigid drives
    kink                          d_k, not positive
    """

    forward: Floats
    backward: Floats
    hardening: Floats
    kink: Floats

    @classmethod
    def of(cls, drives: Drives) -> DriveSprings:
        """Of the drives of one design."""
        n = drives.transmission
        forward, dry = n**2 * drives.stiffness, drives.nonlinearity
        if dry is None:
            return cls(forward, forward, np.zeros(len(n)), np.zeros(len(n)))
        given = np.isfinite(dry.backward_stiffness) & np.isfinite(forward)
        backward = np.where(given, n**2 * np.where(given, dry.backward_stiffness, 0.0), forward)
        return cls(forward, backward, n**4 * dry.hardening, kinks(drives, dry))

    @property
    def flexible(self) -> Ints:
        """Which drives are flexible."""
        return np.flatnonzero(np.isfinite(self.forward))

    def settled(self, deflection: Floats, rounding: float) -> Floats:
        """The deflections (d,), those at the kink to rounding, a torque [N m], just there: without torque, what is
        left by a search would else decide on the stiffness."""
        flexible = np.isfinite(self.forward) & (self.forward != self.backward)
        near = np.where(flexible, self.forward, 0.0) * np.abs(deflection - self.kink) <= rounding
        return np.where(flexible & near, self.kink, deflection)

    def at_kink(self, deflection: Floats) -> Flags:
        """(d,)  which drives are bent to just where their stiffness changes."""
        return np.asarray(np.isfinite(self.forward) & (self.forward != self.backward) & (deflection == self.kink))

    def torque(self, deflection: Floats) -> Floats:
        """Torques (d,) of deflections (d,), 0 of rigid drives."""
        flexible = np.isfinite(self.forward)
        k, other = (np.where(flexible, each, 0.0) for each in (self.forward, self.backward))
        past = np.minimum(deflection - self.kink, 0.0)
        return np.asarray(k * deflection + (other - k) * past + self.hardening * deflection**3)

    def tangent(self, deflection: Floats, backward: bool) -> Floats:
        """dT/dd (d,): k + 3 k_3 d^2, inf of rigid drives.

        backward  which branch is meant of a drive at its kink
        """
        lags = (deflection < self.kink) | ((deflection == self.kink) & backward)
        return np.asarray(np.where(lags, self.backward, self.forward) + 3.0 * self.hardening * deflection**2)
