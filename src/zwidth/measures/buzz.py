"""The vibration that friction, encoder steps or limits keep up at a wanted wall, and the least that is felt.

On the skin of the hand, by contactors of 2.9 cm² and more, the threshold is flat up to 40 Hz, falls by 12 dB an
octave to its least at about 250 Hz (Gescheider and Verrillo, in Sensory Functions of the Skin of Humans, 1979: the
abstract was read), and rises again above, the curve being U-shaped. Its level at 250 Hz is commonly given as 20 dB
below a micrometre (Verrillo 1963; Bolanowski, Gescheider, Verrillo and Checkosky 1988; both known at second hand).
So here

    A(f) = 0.1 um x  (250/40)^2      up to 40 Hz
                     (250/f)^2       to 250 Hz
                     (f/250)^2       above, the slope that is the same there being our choice

as the amplitude of a sine. An object held in the whole hand is felt at less: Brisben, Hsiao and Johnson (Journal
of Neurophysiology 81, 1999; abstract read) found the least thresholds between 150 and 200 Hz, below 0.01 um
in some subjects, and at 40 and 300 Hz 9.8 and 18.5 dB below those of a thin probe. Who asks that nobody feels
anything in a full grasp asks for a tenth of this threshold.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.contact.wall_limit_cycles import amplitude_dependent, predict_limit_cycles, settles
from zwidth.errors import FeedbackError, MeasureError, NoAnswerError, NoValueError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import WantedWall
from zwidth.measures.deformation import deformation_ratio
from zwidth.measures.preconditions import wall_of

BETWEEN_COUNTS = 0.5  # of an encoder's step: the worst place that a constant push can choose


def buzz_at(point: OperatingPoint, wanted: WantedWall) -> float:
    """Amplitude of the largest vibration that remains at the wanted wall, over the least one that the hand feels.

    0 where none remains; inf where the device goes on growing to the end of its range. The vibration is looked for
    about a count and, with encoder steps, midway between two: the larger one counts.

    Raises  MeasureError  where nothing in the device depends on the amplitude
            NoValueError  with feedback beside the wall law, or under load
    """
    wall = wall_of(wanted)
    try:
        parts = amplitude_dependent(point)
    except NoAnswerError as error:
        raise MeasureError(f"has nothing to measure: {error}") from None
    except FeedbackError as error:
        raise NoValueError(str(error)) from None
    offsets = (0.0, BETWEEN_COUNTS) if "encoder steps" in parts else (0.0,)
    return max(_largest_over_threshold(point, *wall, offset) for offset in offsets)


def _largest_over_threshold(point: OperatingPoint, K: float, B: float, offset: float) -> float:
    """Largest ratio of handle amplitude and threshold over the stable limit cycles on a wall K [N/m], B [N s/m];
    0 without any, inf where vibration grows beyond the range, or does not decay and settles in none. offset: its
    middle as a share of an encoder step."""
    prediction = predict_limit_cycles(point, K, B, offset=offset, simulate=False)
    kept_up = [cycle for cycle in prediction.cycles if settles(cycle)]
    if prediction.leaves_range or (prediction.verdict == "unstable" and not kept_up):
        return float("inf")
    ratios = [0.0]
    for cycle in kept_up:
        moved = cycle.amplitude  # of the sensor; then of the handle
        if point.plant.handle is not None:
            moved *= float(np.abs(deformation_ratio(point.plant, cycle.frequency_Hz)))
        ratios.append(moved / float(detection_threshold(cycle.frequency_Hz)))
    return max(ratios)


LEAST: Final = 1e-7  # m
FLAT_UP_TO, MOST_SENSITIVE = 40.0, 250.0  # Hz


def detection_threshold(frequency: ArrayLike) -> Floats:
    """Amplitude of the least sinusoidal vibration that the hand feels (see above).

    frequency  (...)  [Hz], at least 0
    Returns    (...)  [m]

    >>> detection_threshold([1.0, 40.0, 125.0, 250.0, 500.0]).tolist()
    [3.90625e-06, 3.90625e-06, 4e-07, 1e-07, 4e-07]
    """
    f = np.maximum(np.asarray(frequency, dtype=np.float64), FLAT_UP_TO)
    return np.asarray(LEAST * np.maximum(MOST_SENSITIVE / f, f / MOST_SENSITIVE) ** 2)
