"""The step of an encoder, read off its readings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from zwidth.arrays import Floats

ROUNDING: Final = 1e-12  # of the largest reading, below which a difference is rounding
LEAST, LEAST_BEND = 1e-9, 1e-4  # of the largest change, and of the largest change of changes, likewise
CLOSE, NEAR = 20.0, 50.0  # steps: differences below the first are judged, those below the second refine the step
FEWEST: Final = 5  # differences that are judged, where readings do not mostly stand still
WHOLE: Final = 0.02  # by which a difference may miss a whole number of steps
MOST_WHOLE: Final = 0.98  # share of the differences that are whole
LONGEST: Final = 1 << 20  # readings of a stretch that are looked at


def encoder_step(stretches: Sequence[Floats]) -> float:
    """The step of an encoder, in the unit of its readings; 0 where the readings show none.

    Changes from reading to reading are whole multiples of it, and so are their changes, which are few where the
    readings drift far from sample to sample. Where all motion is of more than 20 steps a sample no step shows, nor
    does it matter. Of readings that were rounded when they were written to a file it is the last digit, where that
    is coarser.

    stretches  readings (n,) without a gap in between
    """
    readings = [one[:LONGEST] for one in stretches if len(one) > 1]
    if not readings:
        return 0.0
    rounding = ROUNDING * max(float(np.max(np.abs(one))) for one in readings)
    changes = np.abs(np.concatenate([np.diff(one) for one in readings]))
    bends = np.abs(np.concatenate([np.diff(one, n=2) for one in readings]))
    step = _common_step(changes, max(LEAST * float(np.max(changes)), rounding))
    return step or _common_step(bends, max(LEAST_BEND * float(np.max(bends, initial=0.0)), rounding))


def _common_step(differences: Floats, least: float) -> float:
    """What all of these (n,) are whole multiples of, more than one of it; 0 where there is no such step.

    least  below which a difference is rounding
    """
    changed = differences[differences > least]
    if not len(changed):
        return 0.0
    step = float(np.min(changed))
    near = changed[changed < NEAR * step]
    step = float(np.median(near / np.rint(near / step)))
    shares = changed[changed < CLOSE * step] / step
    multiples = np.rint(shares)
    whole = np.abs(shares - multiples) < WHOLE
    several = len(np.unique(multiples)) + (len(changed) < len(differences)) > 1
    standing = 2 * len(changed) < len(differences)  # readings without steps never stand still
    enough = several and (len(shares) >= FEWEST or standing)
    return step if enough and float(np.mean(whole)) > MOST_WHOLE else 0.0
