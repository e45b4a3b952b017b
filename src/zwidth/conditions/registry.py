"""All published conditions on one loop, side by side."""

from __future__ import annotations

from math import isinf, nan

from zwidth.conditions import (
    abbott_okamura,
    colgate_schenkel,
    diolaiti,
    gil,
    hulin,
    mehling,
    one_mode,
    passivity,
    spring_stability,
    thesis_damped,
    thesis_flexible,
    thesis_flexible_series,
    thesis_rigid,
    thesis_unit_delay,
    thesis_whole_delay,
)
from zwidth.conditions.assumptions import Bound, case_of
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import require

CONDITIONS = (
    thesis_rigid.condition,
    thesis_damped.condition,
    thesis_damped.tangent_condition,
    thesis_unit_delay.condition,
    thesis_whole_delay.condition,
    thesis_flexible.condition,
    thesis_flexible_series.condition,
    thesis_flexible_series.linear_condition,
    one_mode.condition,
    gil.condition,
    hulin.condition,
    spring_stability.condition,
    colgate_schenkel.condition,
    colgate_schenkel.filtered_condition,
    passivity.condition,
    mehling.condition,
    abbott_okamura.condition,
    diolaiti.condition,
)


def compare(
    loop: Loop, *, wall_damping: float = nan, coulomb_friction: float = nan, resolution: float = nan
) -> list[Bound]:
    """Every condition of this package on a loop, always in the same order.

    A condition is evaluated with the numbers of the plant listed in its `taken` even where the device does not
    meet its assumptions: `Bound.violated` lists these, and its limit is then not to be relied on.

    wall_damping      B of the walls, for assumptions on it [N s/m]; nan: these assumptions count as met
    coulomb_friction  f_c, dry friction against the ground where the wall acts [N]; nan: not known
    resolution        Delta, the encoder's step there [m]; nan: not known
    Raises            ValueError  for an infinite wall_damping;  TypeError  for a loop that is no `Loop`

    >>> import numpy as np
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> free_mass = Plant(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> "rigid mass" in [bound.name for bound in compare(Loop(free_mass, Controller(1.0))) if bound.holds]
    True
    """
    require("loop", loop, Loop)
    if isinf(wall_damping):
        raise ValueError(f"wall_damping must be finite, or nan for none, got {wall_damping:g}")
    case = case_of(loop, wall_damping, coulomb_friction, resolution)
    return [condition(case) for condition in CONDITIONS]
