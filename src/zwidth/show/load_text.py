"""What a load does to a device, in sentences and rows: of its equilibrium, and of a path of pushes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.model.mechanism import PRISMATIC
from zwidth.show.units import SPACE, amount, as_written, percent, quantity, seconds, signed, vector

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.model.equilibrium import Equilibrium
    from zwidth.study.loaded_charts import LoadPath

ROUNDING: Final = 1e-9  # share of a stiffness, of a force or of a torque below which it is rounding
UNCHANGED: Final = 5e-7  # share of a stiffness that its four digits do not show
Row = tuple[str, str]


def balance_rows(point: OperatingPoint, stiffness_max: float | None = None) -> Iterator[Row]:
    """Rows (label, value) on the equilibrium of a point under load.

    stiffness_max  of its chart [N/m]; None: not known
    """
    found = point.equilibrium
    yield "balance", balance_text(found)
    if stiffness_max is not None and found.load.pushes and stiffness_max > 0.0:
        valid = amount(found.one_sided_amplitude(stiffness_max), "m")
        yield "one-sided wall", f"as charted while the amplitude stays below F/K, {valid} at the largest stiffness"


def balance_text(found: Equilibrium) -> str:
    """The forces in balance in words: of the wall, and of the hand, with what of it acts across the direction."""
    turns = not np.any(found.screw[:3])  # a moment about an axis is rendered, no force
    force, unit = (found.hand_moment, "N m") if turns else (found.hand_force, "N")
    text = f"wall {amount(found.wall_force, unit)}, hand {vector(force, unit)}"
    if has_sideways_force(found):
        across = vector(found.sideways_force, unit)
        text += f", of which {across} across the direction, which this posture needs"
    return text


def has_sideways_force(found: Equilibrium) -> bool:
    """Whether the hand pushes across the direction by more than rounding.

    Force and moment compare by the mechanism's size: a moment counts as a force at that distance.
    """
    size, renders_force = float(found.motions.mech.size[0]), np.any(found.screw[:3])
    force, moment = (float(np.linalg.norm(part)) for part in (found.hand_force, found.hand_moment))
    whole = max(force, moment / size) if renders_force else max(moment, force * size)
    return bool(np.linalg.norm(found.sideways_force) > ROUNDING * whole)


def drive_rows(point: OperatingPoint) -> Iterator[Row]:
    """Rows (label, value) on each motor: its torque, and how far its drive is bent."""
    found, drives, mechanism = point.equilibrium, point.drives, point.mechanism
    assert mechanism is not None
    slides = mechanism.links.joint[drives.joint] == PRISMATIC
    torques = motor_torques(found)
    for name, torque, bent, slide in zip(drives.names, torques, found.deflections.tolist(), slides, strict=True):
        flexible = f", its drive bent by {amount(bent, 'm' if slide else 'rad')}" if bent else ""
        yield f"motor {name}", f"{amount(torque, 'N m')}{flexible}"


def motor_torques(found: Equilibrium) -> list[float]:
    """Torque of each motor on its own side of the transmission [N m], 0 where it is rounding."""
    torques = found.torques / found.ratio
    torques[np.abs(torques) < ROUNDING * np.max(np.abs(torques), initial=0.0)] = 0.0
    return list(torques.tolist())


# --- a path of pushes -------------------------------------------------------------------------------


def path_sentences(path: LoadPath) -> list[str]:
    """What the charts under all pushes say."""
    texts = _stiffness_text, _neglected_text, _fixed_surface_text, _sideways_text
    said = [*(text(path) for text in texts), *_unanswered_sentences(path)]
    return [sentence for sentence in said if sentence]


def _stiffness_text(path: LoadPath) -> str:
    """Sentence on the largest stiffness over the pushes; "" where no push has one."""
    values, pushes, free = path.stiffness_max, path.pushes, path.unpushed.stiffness_max
    have = np.isfinite(values)
    if not have.any():
        return ""
    low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
    if have.sum() == 1:
        return (
            f"A wall is stable under {as_written(pushes[high], 'N')} alone, up to {quantity(values[high], 'N/m')}."
        )
    if values[high] - values[low] <= UNCHANGED * values[high]:
        return f"The largest stiffness is {quantity(values[high], 'N/m')} under every push{_that_has_one(have)}."
    ends = " to ".join(f"{quantity(values[k], 'N/m')} under {as_written(pushes[k], 'N')}" for k in (low, high))
    if np.isnan(free):
        return f"The largest stiffness goes from {ends}; without a push no wall is stable."
    changes = " to ".join(f"{signed(100.0 * (values[k] - free) / free)}{SPACE}%" for k in (low, high))
    return f"The largest stiffness goes from {ends}: {changes} of the {quantity(free, 'N/m')} without a push."


def _that_has_one(have: Flags) -> str:
    """Words that limit a statement to pushes with a stable wall; "" where all have one."""
    return "" if have.all() else " that has one"


def _sideways_text(path: LoadPath) -> str:
    """Sentence on motions along the surface, which no wall holds: under which pushes one grows, and how fast.

    "" where none is known because no push has a stable wall
    """
    rates, pushes = path.growth_rates, path.pushes
    known = np.isfinite(rates)
    if not known.any():
        return "" if path.reason else "No free motion stands apart from the walls: the charts count every one."
    growing = known & (rates > 0.0)
    if not growing.any():
        return "No motion along the surface grows."
    fastest = int(np.argmax(np.where(growing, rates, 0.0)))
    motion = path.steps[fastest].sideways
    assert motion is not None
    shape = f", as a vibration of {quantity(motion.frequency, 'Hz')}" if motion.frequency else ""
    doubles = f"{as_written(pushes[fastest], 'N')}, where it doubles in {seconds(motion.time_to_double)}{shape}"
    where = pushes_text(pushes, growing)
    return f"Along the surface, where no wall acts, a motion grows under {where}: fastest under {doubles}."


def _neglected_text(path: LoadPath) -> str:
    """Sentence on how much it changes the stiffness to neglect the change of the hand's force.

    "" where the path's own charts neglect it, or no push has both stiffnesses
    """
    difference = _largest_difference(path, path.hand_neglected)
    if difference is None or path.hand == "neglected":
        return ""
    share, push = difference
    if share < ROUNDING:
        return "Whether the change of the hand's force is neglected makes no difference to these stiffnesses."
    largest, under = percent(share), as_written(push, "N")
    return f"Neglecting the change of the hand's force changes it by {largest} at most, under {under}."


def _fixed_surface_text(path: LoadPath) -> str:
    """Sentence on the largest stiffness on a fixed surface, into which the handle sinks, against a kept posture.

    Without any such stiffness the reasons; "" where no push has a chart
    """
    sinks = "On a fixed surface, into which the handle sinks by F/K,"
    difference = _largest_difference(path, path.fixed_surface)
    if difference is None:
        pushed = [step for step in path.steps if step.push and step.stiffness_max == step.stiffness_max]  # not nan
        reasons = sorted({step.fixed_surface_status for step in pushed})
        return f"{sinks} there is no answer: {'; '.join(reasons)}." if reasons else ""
    share, push = difference
    if share < ROUNDING:
        return f"{sinks} the largest stiffness is the same."
    largest, under = percent(share), as_written(push, "N")
    return f"{sinks} it differs from that with the posture kept by {largest} at most, under {under}."


def _largest_difference(path: LoadPath, others: Floats) -> tuple[float, float] | None:
    """Return the largest relative difference of stiffnesses from the path's own, and the push [N] that has it.

    others   (pushes,) largest stiffness under each push, computed otherwise [N/m]
    Returns  None where no push but 0 has both stiffnesses
    """
    values, pushes = path.stiffness_max, path.pushes
    both = np.isfinite(values) & np.isfinite(others) & (pushes != 0.0)
    if not both.any():
        return None
    share = np.where(both, np.abs(others - values) / np.where(both, values, 1.0), -1.0)
    k = int(np.argmax(share))
    return float(share[k]), float(pushes[k])


def _unanswered_sentences(path: LoadPath) -> Iterator[str]:
    """A sentence for each kind of status without a largest stiffness: under which pushes, and why.

    The reason is that of the weakest push.
    """
    missing = [step for step in path.steps if step.stiffness_max != step.stiffness_max]  # nan
    for kind in dict.fromkeys(step.status.partition(":")[0] for step in missing):
        of_kind = [step for step in missing if step.status.partition(":")[0] == kind]
        under_kind = np.array([step in of_kind for step in path.steps])
        weakest = min(of_kind, key=lambda step: abs(step.push))
        yield f"Without an answer, {pushes_text(path.pushes, under_kind)}: {weakest.status.rstrip('.')}."


def pushes_text(pushes: Floats, chosen: Flags) -> str:
    """Some of the pushes [N] in words: each stretch of neighbours from its first to its last.

    chosen  (pushes,) true for those to be said
    """
    # first place of a stretch and the place behind its last, in turns
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]])))
    stretches = [
        (float(pushes[start]), float(pushes[stop - 1]))
        for start, stop in zip(edges[::2], edges[1::2], strict=True)
    ]
    return " and ".join(
        as_written(low, "N") if low == high else f"{as_written(low, 'N')} to {as_written(high, 'N')}"
        for low, high in stretches
    )
