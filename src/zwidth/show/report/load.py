"""The report's section on a load: who carries what, what it changes, and what moves along the surface."""

from __future__ import annotations

import numpy as np

from zwidth.errors import NoAnswerError
from zwidth.loop.loop import SidewaysMotion
from zwidth.measures.load_effect import load_change
from zwidth.model.load import Load
from zwidth.show.circumstances import load_text
from zwidth.show.load_text import ROUNDING, has_sideways_force, motor_torques, path_sentences
from zwidth.show.report.facts import Facts
from zwidth.show.units import MINUS, SPACE, number, point, quantity, seconds, signed


def sentences(facts: Facts) -> list[str]:
    """What is said of the load; [] for a device that bears none."""
    if facts.point.load is None:
        return []
    said = [carried(facts), across(facts), change(facts), never_pulling(facts), other_branch(facts), along(facts)]
    return [sentence for sentence in said if sentence]


def path(facts: Facts) -> list[str]:
    """What the charts under pushes to both sides say; [] for a device that bears none."""
    return [] if facts.load_path is None else path_sentences(facts.load_path)


def load_name(load: Load) -> str:
    """A load in words, with real minus signs."""
    return load_text(load).replace("-", MINUS)


def carried(facts: Facts) -> str:
    """The forces that are in balance."""
    assert facts.point.load is not None
    found = facts.point.equilibrium
    motors = ", ".join(
        f"{name} {quantity(torque, 'N m')}"
        for name, torque in zip(facts.point.drives.names, motor_torques(found), strict=True)
    )
    if np.any(found.screw[:3]):
        hand, way = point(found.hand_force, "N"), "along the direction"
    else:
        hand, way = point(found.hand_moment, "N m"), "about the axis"
    return (
        f"The device is linearised where it is in balance under {load_name(facts.point.load)}: the hand gives "
        f"{hand}, the wall {quantity(found.wall_force, 'N')} {way}, and the motors {motors}."
    )


def across(facts: Facts) -> str:
    """The hand's force across the direction; "" where there is none."""
    found = facts.point.equilibrium
    if not has_sideways_force(found):
        return ""
    part = point(found.sideways_force, "N" if np.any(found.screw[:3]) else "N m")
    return f"Of the hand's force {part} is across the direction, where no wall acts: this posture needs it."


def change(facts: Facts) -> str:
    """By how much the load moves the largest stiffness."""
    try:
        share = load_change(facts.point)
    except NoAnswerError as error:
        return f"What the load changes of the largest stiffness has no number: {error}."
    # the change is a share of the stiffness without the load
    bare = quantity(facts.base.stiffness_max / (1.0 + share), "N/m")
    if abs(share) < ROUNDING:
        return f"The load does not change the largest stiffness: without it, too, it is {bare} in this posture."
    moved = f"{signed(100.0 * share)}{SPACE}%"
    return f"The load changes the largest stiffness by {moved}, from {bare} without it in this posture."


def never_pulling(facts: Facts) -> str:
    """Up to which amplitude, F/K, a wall that never pulls is as charted; "" without a push or a stable wall."""
    found = facts.point.equilibrium
    if not (found.load.pushes and facts.renders):
        return ""
    amplitude = quantity(found.one_sided_amplitude(facts.base.stiffness_max), "m")
    return (
        "A wall that pushes and never pulls is as charted while vibrations stay below F/K, which at the largest "
        f"stiffness is {amplitude}."
    )


def other_branch(facts: Facts) -> str:
    """The chart on the other branch of springs at the edge of two stiffnesses; "" where there are none."""
    other = facts.point.other_branch
    if other is None:
        return ""
    names = ", ".join(facts.point.drives.names[i] for i in facts.point.equilibrium.kinked)
    peak = other.chart(decay=False).stiffness_max
    reached = "no wall" if np.isnan(peak) else f"walls of up to {quantity(peak, 'N/m')}"
    return (
        f"The stiffness of {names} changes where there is no torque, as here: with its other stiffness the device "
        f"renders {reached}. A wall that is stable with both is not proven stable for the device that "
        "switches between them."
    )


def along(facts: Facts) -> str:
    """The motions along the surface, each with its growth or decay; "" where all count for the chart."""
    texts = [_motion_text(motion) for motion in facts.loop.sideways_motions]
    if not texts:
        return ""
    stand = "a motion stands" if len(texts) == 1 else f"{len(texts)} motions stand"
    each = "it" if len(texts) == 1 else "one"
    return (
        f"Along the surface, where no wall acts, {stand} apart from the chart: {each} {f'; {each} '.join(texts)}."
    )


def _motion_text(motion: SidewaysMotion) -> str:
    """One motion along the surface in words: its frequency if it vibrates, and its growth or decay."""
    rate = "neither grows nor decays"
    if motion.growth_rate > 0.0:
        rate = f"grows by {number(motion.growth_rate)}{SPACE}1/s and doubles in {seconds(motion.time_to_double)}"
    elif motion.growth_rate < 0.0:
        rate = f"decays by {number(-motion.growth_rate)}{SPACE}1/s"
    return f"vibrates at {quantity(motion.frequency, 'Hz')}, {rate}" if motion.frequency else rate
