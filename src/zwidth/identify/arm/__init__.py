"""Dynamic parameters of a mechanism from the torques and the motion of its joints."""

from zwidth.identify.arm.checks import COLUMNS
from zwidth.identify.arm.identify import ArmIdentification, identify_arm

__all__ = ["COLUMNS", "ArmIdentification", "identify_arm"]
