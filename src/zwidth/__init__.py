"""zwidth: which virtual walls a haptic device can render, what limits them, and what to change."""

__version__ = "0.1.0"
