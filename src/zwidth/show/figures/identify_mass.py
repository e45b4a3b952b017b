"""The figure of an identified mass: that of friction, which the same fit finds."""

from __future__ import annotations

from zwidth.show.figures.identify_friction import draw_friction as draw_mass

__all__ = ["draw_mass"]
