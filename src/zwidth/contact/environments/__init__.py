"""Virtual environments: small compiled functions that say what force a device is to feel; ours by name."""

from zwidth.contact.environments.catalogue import (
    ENVIRONMENTS,
    coupled_wall,
    friction_patch,
    grating,
    hunt_crossley,
    load_environment,
    nonlinear_wall,
    one_sided_wall,
    slot,
    texture,
    virtual_mass,
    wall,
)
from zwidth.contact.environments.environment import (
    MEMORY,
    SIGNATURE,
    Environment,
    Parameter,
    environment,
    environment_at,
)

__all__ = [
    "ENVIRONMENTS",
    "MEMORY",
    "SIGNATURE",
    "Environment",
    "Parameter",
    "coupled_wall",
    "environment",
    "environment_at",
    "friction_patch",
    "grating",
    "hunt_crossley",
    "load_environment",
    "nonlinear_wall",
    "one_sided_wall",
    "slot",
    "texture",
    "virtual_mass",
    "wall",
]
