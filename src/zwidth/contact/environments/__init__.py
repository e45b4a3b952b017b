"""Virtual environments: small compiled functions that say what force a device is to feel; ours by name."""

from zwidth.contact.environments.catalogue import ENVIRONMENTS
from zwidth.contact.environments.environment import (
    MEMORY,
    SIGNATURE,
    Environment,
    Parameter,
    environment,
    environment_at,
)
from zwidth.contact.environments.load import load_environment

__all__ = [
    "ENVIRONMENTS",
    "MEMORY",
    "SIGNATURE",
    "Environment",
    "Parameter",
    "environment",
    "environment_at",
    "load_environment",
]
