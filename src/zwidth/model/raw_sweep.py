"""From a raw sweep, samples of commanded force and encoder position, to a response with coherence.

The step of an encoder, read off its readings.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.errors import ResponseError
from zwidth.model.local_polynomials import (
    MOST_TILES,
    NARROWEST,
    NARROWEST_WINDOW,
    LocalResponse,
    PieceSums,
    local_response,
    merged_windows,
    window_widths,
)
from zwidth.model.response import Response

SHORTEST_SEGMENT = 64  # samples
EXCITED = 1e-7  # power of the force, over its largest, below which a frequency was not excited
LEFT_AT_END = 0.1  # the same over that at frequencies from half of it on: there an excitation ends
AVERAGES = 8.0  # in a spectrum of which the coherence that is given leaves the same error
SLOW = 4.0  # times lower a frequency is that of motion which does not blur an encoder's steps
LARGEST_IN_DEVIATIONS = 3.0  # what is a bound is taken as so many standard deviations
PIECE, MOST_PIECES = 64, 2000  # samples in which the frequencies of a force at one time are counted
CLOSEST = 3.0  # spacing of the response's frequencies, in those of the record's transform
RATIO = 0.01  # the same in shares of the frequency, from where that is wider
BLOCK = 2**20  # samples of a long record that are transformed at once; its response is one over all blocks
SEGMENTS_IN_BLOCK = 256  # that were given; so that a window of 64 spacings is no wider than theirs


def sweep_response(
    force: Floats, position: Floats, period: float, integrators: int | None = None, segment: int | None = None
) -> Response:
    """The response P of a sampled record, and the coherence that tells its error.

    By polynomials over the transform of the whole record (`local_polynomials`); of a record of more than two
    million samples over those of blocks of a million (`local_polynomials`). A device without a spring drifts; so
    the position is differenced first, once for each integrator (twice where their number is not known), and the
    result divided by (z - 1)^m again. Noise is taken to be at least that of the encoder's steps, q^2 / 12 in each
    reading, whatever the record shows: readings that follow the force alone hide it.

    force, position  (n,) [N], [m], one sample per period; position[j] is read when force[j] is sent
    integrators      poles at z = 1: 0, 1 or 2; None: not known
    segment          samples whose transform resolves what must be told apart: frequencies are no closer than its
                     spacing, the lowest at twice that, and windows no narrower; None: three periods in the record
    Returns          frequencies 1 % apart, but no closer than that; `coherence` is what would leave the same error
                     in a spectrum of `averages` averages
    Raises           ResponseError  where the record is shorter than two segments, or the force is constant

    >>> rng = np.random.default_rng(1)
    >>> force = rng.normal(size=20_000)
    >>> position = np.concatenate([[0.0], np.cumsum(force)[:-1]])       # P = 1 / (z - 1)
    >>> found = sweep_response(force, position, period=0.001, integrators=1)
    >>> z = np.exp(2j * np.pi * found.frequency * 0.001)
    >>> float(np.max(np.abs(found.value * (z - 1.0) - 1.0))) < 1e-9
    True
    """
    size = block_length(len(force), segment)
    starts = range(0, len(force) - size + 1, size)
    blocks = ((force[start : start + size], position[start : start + size]) for start in starts)
    return sweep_response_of_blocks(blocks, period, integrators, segment)


def block_length(samples: int, segment: int | None = None) -> int:
    """Number of samples in each of the blocks that a record of so many `samples` is cut into: all, of a long
    record about `BLOCK`. segment as in `sweep_response`."""
    block = BLOCK if segment is None else max(BLOCK, SEGMENTS_IN_BLOCK * segment)
    return samples if samples < 2 * block else samples // (samples // block)


def sweep_response_of_blocks(
    blocks: Iterable[tuple[Floats, Floats]],
    period: float,
    integrators: int | None = None,
    segment: int | None = None,
) -> Response:
    """The response as by `sweep_response`, from blocks of force and position (n,), all of one length, which are
    read one after the other and not kept: least squares over all of them (`local_polynomials`).

    Raises  ResponseError  as `sweep_response` does
    """
    m = 2 if integrators is None else integrators
    length = segment or SHORTEST_SEGMENT
    blocks = iter(blocks)
    first, second = next(blocks, (np.zeros(0), np.zeros(0))), next(blocks, None)
    samples = len(first[0])
    _check_samples(samples, length, m)
    count = samples - m if second is None else fast_length(samples - m)
    values = count // 2 + 1
    narrowest = _narrowest_window(NARROWEST if second is None else NARROWEST_WINDOW, count, values, segment)
    sums = None if second is None else PieceSums(values, narrowest)
    every = chain([first], [] if second is None else [second], blocks)
    sizes, step, U, Y = _read_blocks(every, m, count, sums)
    whole = _ForceSize.together(sizes)
    if whole.low == whole.high:
        raise ResponseError(f"the commanded force is {whole.low:g} N all the time; excite the device")
    step = step if np.isfinite(step) else 0.0
    # the encoder's rounding, q^2/12 in each reading, in the transform of the position differenced m times
    floor = count * step**2 / 12.0 * np.abs(2.0 * np.sin(np.pi * np.arange(values) / count)) ** (2 * m)
    places = _places(samples, segment) * count
    local = _response_of_blocks(U, Y, sums, places, floor, narrowest)
    gain = np.abs(2.0 * np.sin(np.pi * places / count)) ** m
    hidden = _hidden_by_steps(whole, step, places / count, local, gain, samples)
    value, coherence = _value_and_coherence(local, hidden, gain, places, count, m)
    excited = _excited(places, local.excited) & np.isfinite(coherence) & np.isfinite(value)
    return Response(
        frequency=places / count / period,
        value=np.where(np.isfinite(value), value, 0.0),
        integrators=integrators,
        coherence=np.where(excited, coherence, 0.0),
        averages=AVERAGES,
        freedom=local.freedom,
        note=f"from {len(sizes) * samples} samples by local polynomials",
    )


def _check_samples(samples: int, length: int, m: int) -> None:
    """Raise ResponseError where a block's samples are too few for two segments of this length, after m
    differences."""
    if length < SHORTEST_SEGMENT or samples < 2 * length + m:
        raise ResponseError(
            f"has {samples} samples, too few for two segments of {max(length, SHORTEST_SEGMENT)}; record "
            f"longer, or set segment_samples (at least {SHORTEST_SEGMENT})"
        )


def _narrowest_window(least: int, count: int, values: int, segment: int | None) -> int:
    """Return half the narrowest window, in spacings of a transform of `count` samples with so many values; even.

    least  below which it must not be;   segment  samples, as in `sweep_response`
    """
    # half a segment's spacing, or a width that makes MOST_TILES of them; 2 * (... // 2) is even
    narrowest = max(least, 2 * (count // (4 * segment)) if segment else 2 * (values // (2 * MOST_TILES)))
    # a window lies beside the first value and has one more than twice this
    return min(narrowest, 2 * ((values - 2) // 4))


def _read_blocks(
    blocks: Iterable[tuple[Floats, Floats]], m: int, count: int, sums: PieceSums | None
) -> tuple[list[_ForceSize], float, Complexes, Complexes]:
    """Read all blocks of force [N] and position [m], at least one, and add their transforms to the sums.

    m      times that the position is differenced;   count  samples that are transformed
    Returns  the force's size in each block, the encoder's step [m] (inf where the readings show none), and the
             last block's two transforms (count // 2 + 1,)
    """
    sizes, step = list[_ForceSize](), np.inf
    for force, position in blocks:
        sizes.append(_ForceSize.of(force))
        step = min(step, encoder_step([position]) or np.inf)
        U, Y = transforms(force, position, m, count)
        if sums is not None:
            sums.add(U, Y)
    return sizes, step, U, Y


def _response_of_blocks(
    U: Complexes, Y: Complexes, sums: PieceSums | None, places: Floats, floor: Floats, narrowest: int
) -> LocalResponse:
    """Return the response Y / U (n,) [m/N] at places (n,), in spacings of the transforms.

    U, Y       (k,) transforms of the last block;   sums  over all blocks; None: there is one block
    floor      (k,) least variance of the noise in Y;   narrowest  half the narrowest window, in spacings
    """
    if sums is None:
        return local_response(U, Y, places, floor, narrowest)
    return merged_windows(sums.fits(window_widths(len(U) - 1, narrowest)), places, floor)


def _value_and_coherence(
    local: LocalResponse, hidden: Floats, gain: Floats, places: Floats, count: int, m: int
) -> tuple[Complexes, Floats]:
    """Return the response (n,) [m/N] and its coherence (n,), not finite where nothing is known.

    local  the response of the position differenced m times;   hidden  error of P that no scatter shows (n,) [m/N]
    gain   (n,) |z - 1|^m;   places  (n,) frequencies, in spacings of a transform of `count` samples
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = (local.variance + (hidden * gain) ** 2) / np.abs(local.value) ** 2
        coherence = 1.0 / (1.0 + AVERAGES * relative)
        value = local.value / (np.exp(2j * np.pi * places / count) - 1.0) ** m
    return value, coherence


def fast_length(samples: int) -> int:
    """The number of samples, or one a little smaller whose transform is fast."""
    from scipy.fft import prev_fast_len

    return int(prev_fast_len(samples))


def transforms(force: Floats, position: Floats, m: int, count: int) -> tuple[Complexes, Complexes]:
    """Transforms of force, and of position differenced m times, over their first `count` samples."""
    from scipy.fft import rfft

    return np.asarray(rfft(force[:count])), np.asarray(rfft(np.diff(position, n=m)[:count]))


@dataclass(frozen=True)
class _ForceSize:
    """Size of a force: samples, smallest and largest value, mean, variance [N], and its power in short pieces, and
    that power times the frequencies that share it."""

    samples: int
    low: float
    high: float
    mean: float
    variance: float
    power: float
    shared: float

    @classmethod
    def of(cls, force: Floats) -> _ForceSize:
        """The size of the force of one block (n,) [N]."""
        pieces = force[: len(force) // PIECE * PIECE].reshape(-1, PIECE)
        # of a long block some of them, evenly
        pieces = pieces[:: max(1, len(pieces) // MOST_PIECES)]
        # power of each piece at each frequency, and how many frequencies share it: all alike (sum p)^2 / sum p^2
        power = np.abs(np.fft.rfft(pieces * np.hanning(PIECE), axis=1)) ** 2
        total = np.sum(power, axis=1)
        taking_part = total**2 / np.maximum(np.sum(power**2, axis=1), 1e-300)
        low, high, mean = (float(of(force)) for of in (np.min, np.max, np.mean))
        variance = float(np.mean((force - mean) ** 2))
        return cls(len(force), low, high, mean, variance, float(np.sum(total)), float(np.sum(total * taking_part)))

    @classmethod
    def together(cls, blocks: Sequence[_ForceSize]) -> _ForceSize:
        """The size of the force in all of several blocks of one length."""
        means = [one.mean for one in blocks]
        variance = np.mean([one.variance for one in blocks]) + np.var(means)
        power, shared = (sum(getattr(one, name) for one in blocks) for name in ("power", "shared"))
        low, high = min(one.low for one in blocks), max(one.high for one in blocks)
        samples = sum(one.samples for one in blocks)
        return cls(samples, low, high, float(np.mean(means)), float(variance), power, shared)

    @property
    def broad(self) -> bool:
        """Whether the force holds many frequencies at a time, as noise does and a sweep does not."""
        # on the average a quarter of the PIECE / 2 frequencies of a piece take part
        return self.shared > 0.25 * PIECE / 2.0 * self.power


def _hidden_by_steps(
    force: _ForceSize, step: float, f: Floats, local: LocalResponse, gain: Floats, samples: int
) -> Floats:
    """Error of P (n,) [m/N], as a deviation, that the encoder's steps make and no scatter shows.

    A sine of amplitude A is read with an error that follows it: where it is smaller than a step it is not read at
    all, or as a square wave of 2 q / pi; where it is larger the error falls like q (q / A)^(1/2). Any other motion
    s meanwhile blurs the steps, by exp(-2 pi^2 s^2 / q^2) (dither). As such counts what was read and does not
    follow the force, and under noise the motion at other frequencies; slow motion, slower than 1/4 of the
    frequency, does not, nor what the steps themselves may make, q^2 / 4.

    force  its size over all blocks;   step q [m];   f (n,) frequencies in those of sampling
    samples  of a transform
    local  the response of the differenced position, and gain (n,) = |z - 1|^m
    """
    if step == 0.0:
        return np.zeros(len(f))
    # power of what follows the force, and the spectrum of all motion that may blur the steps
    following = (np.abs(local.value) / gain) ** 2 * local.excited * force.broad
    spectrum = 2.0 * (local.noise / gain**2 + following) / samples
    widths = np.gradient(f)
    # power of the motion at each frequency and all above it
    above = np.cumsum((spectrum * widths)[::-1])[::-1]
    slower = np.searchsorted(f, f / SLOW)
    other_motion = np.maximum(above[slower] - step**2 / 4.0, 0.0)
    amplitude = np.sqrt(2.0 * force.variance)
    steps = np.abs(local.value) / gain * amplitude / step
    # 2 q / pi, times 0.7 (q / A)^(1/2) where A is above half a step; over the force's amplitude: as error of P
    largest = 2.0 / np.pi * np.minimum(1.0, 0.7 / np.sqrt(np.maximum(steps, 1e-9))) * step / amplitude
    return np.asarray(largest * np.exp(-2.0 * np.pi**2 * other_motion / step**2) / LARGEST_IN_DEVIATIONS)


def _excited(places: Floats, power: Floats) -> Flags:
    """Which places (n,), frequencies, the force excites: with some of its power (n,), and not above where it
    ends."""
    usual = np.array([np.median(power[(places >= 0.5 * place) & (places <= place)]) for place in places])
    enough = np.flatnonzero(power >= LEFT_AT_END * usual)
    return np.asarray((power > EXCITED * np.max(power)) & (np.arange(len(places)) <= enough[-1]))


def _places(samples: int, segment: int | None) -> Floats:
    """Frequencies (n,) of the response over that of sampling, up to 1/2: the same for all records of about one
    length; segment as in `sweep_response`."""
    whole = 2 ** int(np.log2(samples))
    spacing = 1.0 / segment if segment else CLOSEST / whole
    # evenly, up to where RATIO of a frequency is as wide as the spacing; above that RATIO apart
    first = np.arange(2.0 if segment else 1.0, 1.0 / RATIO) * spacing
    first = first[first < 0.5]
    steps = np.ceil(np.log(0.5 / first[-1]) / RATIO)
    above = first[-1] * np.exp(np.log(0.5 / first[-1]) * np.arange(1, steps + 1) / max(steps, 1.0))
    return np.asarray(np.minimum(np.concatenate([first, above]), 0.5))


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
    """Step of which most differences (n,) are whole multiples, not all the same one; 0 where there is none such.

    least  below which a difference is rounding
    """
    changed = differences[differences > least]
    if not len(changed):
        return 0.0
    # at first the smallest change, then the median of what changes of not too many steps make it
    step = float(np.min(changed))
    near = changed[changed < NEAR * step]
    step = float(np.median(near / np.rint(near / step)))
    # of many steps the step's own error would hide whether they are whole
    shares = changed[changed < CLOSE * step] / step
    multiples = np.rint(shares)
    whole = np.abs(shares - multiples) < WHOLE
    # no change at all, which is not in `changed`, counts as one more multiple, 0
    several = len(np.unique(multiples)) + (len(changed) < len(differences)) > 1
    standing = 2 * len(changed) < len(differences)  # readings without steps never stand still
    enough = several and (len(shares) >= FEWEST or standing)
    return step if enough and float(np.mean(whole)) > MOST_WHOLE else 0.0
