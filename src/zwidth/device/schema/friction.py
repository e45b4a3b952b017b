"""[friction] of a plant, [mechanism.friction] of drives: dry friction, and how it grips."""

from __future__ import annotations

from typing import Final

from zwidth.device.schema.value_types import (
    Bristle,
    BristleDamper,
    Frictions,
    Section,
    StribeckVelocity,
    documented_key,
)
from zwidth.model.nonlinear import FrictionModel

_MODEL: Final = (
    'how it grips: "coulomb" (one level, and at rest what keeps it there), "dahl" (by bristles that give way) or '
    '"lugre" (by bristles, with a higher level at rest)'
)
_BRISTLES: Final = 'stiffness of the bristles, sigma_0; of "dahl" and "lugre"'
_SLIDING: Final = 'damping of the bristles, sigma_1; of "lugre"'
_STRIBECK: Final = "velocity v_s at which the static level gives way; with a breakaway above it"


class FrictionSection(Section):
    """Dry friction of a [plant], along each of its coordinates."""

    coulomb_N: Frictions = documented_key(
        "level of the friction along each coordinate, n numbers; one for n = 1", "N"
    )
    model: FrictionModel = documented_key(_MODEL, default="coulomb")
    bristle_stiffness_N_per_m: Bristle | None = documented_key(_BRISTLES, "N/m", default=None)
    bristle_damping_Ns_per_m: BristleDamper | None = documented_key(
        _SLIDING + "; omitted: 0", "N s/m", default=None
    )
    breakaway_N: Frictions | None = documented_key(
        'static level along each coordinate, at least coulomb_N; of "lugre"; omitted: coulomb_N', "N", default=None
    )
    stribeck_velocity_m_per_s: StribeckVelocity | None = documented_key(_STRIBECK, "m/s", default=None)


class DriveFrictionSection(Section):
    """How the dry friction of the drives grips, all of them alike, at the motor."""

    model: FrictionModel = documented_key(_MODEL, default="coulomb")
    bristle_stiffness_Nm_per_rad: Bristle | None = documented_key(_BRISTLES, "N m/rad", default=None)
    bristle_damping_Nms_per_rad: BristleDamper | None = documented_key(
        _SLIDING + "; omitted: 0", "N m s/rad", default=None
    )
    stribeck_velocity_rad_per_s: StribeckVelocity | None = documented_key(_STRIBECK, "rad/s", default=None)
