"""Checks of a record before modes are fitted to it, each said with what was seen.

`amplitude_check`: whether the response hangs on the amplitude, as that of a device with friction does. Coulomb
friction f_c on a motion of amplitude X at w takes the energy of a damper 4 f_c/(pi w X), and at motions so
small that it sticks it is a spring. Both fall as the amplitude rises, which tells them from a damper and a spring.

`hand_check`: whether a response tells anything of the hand that holds the device.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.device.faults import plural
from zwidth.identify.identification import Check
from zwidth.identify.modes.local_response import RecordResponse
from zwidth.identify.modes.modal_fit import ModalFit
from zwidth.identify.modes.model import SampledModel, sampled_response, without_hand
from zwidth.identify.modes.overview import Spectra
from zwidth.identify.modes.stretches import Channels, Levels, Source
from zwidth.loop.operating_point import OperatingPoint

COUNTS: Final = 10.0  # steps of the encoder that a motion must have
EXCITED: Final = 1e-6  # power of the force, over its largest, below which a line was not excited
FEWEST_LINES: Final = 10  # excited
AT_LIMIT: Final = 0.02  # share of the samples at the largest force, beyond which it is suspected to be clipped
RELATED: Final = 2.0  # times as large as that of unrelated columns the mean coherence must be
LOST: Final = 0.3  # coherence below which a line says little
TRUSTED: Final = 0.6  # coherence above which a line's phase is believed
RISING: Final = 0.7  # exponent of |P| over frequency, above which force and position are taken for swapped
LOWEST: Final = slice(3, 19)  # lines, above those of a window, at which feedback shows
CONSTANT: Final = 0.3  # by which the force may differ from that of a spring, in the middle
FLIPPED: Final = -0.3  # times as far as the first stretch, below which the sign of another one is turned
EARLY: Final = -0.05  # delay [samples], below which the position comes before the force
EXPLAINED: Final = 2.0  # misfit with which modes explain a response
IMPLAUSIBLE: Final = 20.0  # ratio of the response to the device's, either way, that is remarked
FACTORS_LINEAR: Final = {1e3: "millimetres", 1e6: "micrometres", 1e-3: "kilometres, or the force in millinewtons"}
FACTORS_TURN: Final = {180.0 / np.pi: "degrees", 1e3: "milliradians", 1e-3: "the torque in millinewton metres"}
NEAR: Final = 1.6  # by which a ratio may differ from such a factor
FEW_LEVELS: Final = 8  # of a force that steps between levels on purpose
LEVELS_READ: Final = 100_000  # samples in which they are counted


def level_checks(source: Source, levels: Levels, step: float, given_step: float, limit: float) -> list[Check]:
    """Checks of the values in the columns: constant ones, motion, saturation, drift.

    step        of the encoder as the positions show it; 0 for none
    given_step  of the encoder as the device file gives it; 0 for none
    limit       largest force that the device commands
    """
    names, label = source.channels, source.record.label
    force, position = levels.span  # and so are the entries 0 and 1 of all levels
    checks = list[Check]()
    if force == 0.0:
        value = levels.high[0] + 0.0  # no negative zero
        reason = f"{names.force} of {label} is {value:.6g} all the time; excite the device by noise or a sweep"
        return [Check("excitation", False, reason)]
    if position == 0.0:
        reason = (
            f"{names.position} of {label} is {levels.high[1] + 0.0:.6g} all the time; is the encoder connected, "
            "and read?"
        )
        return [Check("motion", False, reason)]
    larger_step = max(step, given_step)
    if larger_step:
        counts = position / larger_step
        from_where = "as the positions show" if step >= given_step else "by the device file"
        reason = f"{names.position} of {label} moves by {counts:.3g} steps of {larger_step:.3g} ({from_where})"
        if counts < COUNTS:
            reason += f"; at least {COUNTS:.0f} are needed: drive the device harder, or at lower frequencies"
        checks.append(Check("motion", bool(counts >= COUNTS), reason))
    checks.append(_saturation_check(source, levels, limit))
    drift = levels.drift / position
    reason = f"a straight line through {names.position} makes {100.0 * drift:.3g} % of its span"
    checks.append(Check("drift", True, reason + "; the position is differenced twice, so that it does not count"))
    return checks


def _saturation_check(source: Source, levels: Levels, limit: float) -> Check:
    """Check that the force is within the device's largest one, and not held at an amplifier's; a warning where
    many samples are at the largest or the least force.

    limit  largest force that the device commands
    """
    names, label = source.channels, source.record.label
    share = levels.at_limit / levels.count
    largest = float(np.max(np.abs([levels.low[0], levels.high[0]])))
    if largest > limit * (1.0 + 1e-9):
        reason = (
            f"{names.force} of {label} reaches {largest:.4g}, but the device commands {limit:.4g} at most: what "
            "moved it is not what is written; drive it less"
        )
        return Check("saturation", False, reason)
    if share > AT_LIMIT:
        reason = (
            f"{100.0 * share:.3g} % of the samples of {label} have the largest or the least {names.force}, "
            f"{levels.high[0]:.4g} or {levels.low[0]:.4g}: right for steps and binary noise; if an amplifier "
            "clipped it there, write the force that was commanded as command_ and the measured one beside it, "
            "or drive less"
        )
        return Check("saturation", False, reason, warning=True)
    return Check("saturation", True, f"{100.0 * share:.2g} % of the samples are at the largest force")


def force_excitation_check(spectra: Spectra, label: str) -> tuple[Check, Flags]:
    """Check that enough lines are excited; label: what the record is called.

    Returns  the check, and which lines (n,) are excited
    """
    power = spectra.power("force")
    excited = power > EXCITED * max(float(power.max(initial=0.0)), 1e-300)
    f = spectra.frequency[excited]
    if len(f) < FEWEST_LINES:
        reason = (
            f"{plural(len(f), 'frequency', 'frequencies')} of {label} with force; record noise, a sweep or a "
            "multisine that covers the resonances"
        )
        return Check("excitation", False, reason), excited
    reason = f"{len(f)} lines of {label} from {f[0]:.4g} to {f[-1]:.4g} Hz carry force"
    return Check("excitation", True, reason), excited


def coherence_check(spectra: Spectra, excited: Flags, closed: bool) -> tuple[Check, float]:
    """Check that the position follows the force (closed: the reference).

    excited  (n,) lines with force
    Returns  the check, and the frequency above which the coherence has collapsed for good [Hz]: inf where it has
             not, 0 where the position follows nowhere
    """
    into = "reference" if closed else "force"
    coherence = np.where(excited, spectra.coherence(into, "position"), 0.0)
    # over nine lines, so that one line says nothing
    smooth = np.convolve(coherence, np.ones(9) / 9.0, mode="same") if len(coherence) > 20 else coherence
    good = np.flatnonzero((smooth > LOST) & excited)
    f = spectra.frequency
    by_chance = 1.0 / spectra.averages  # that of unrelated columns
    if not len(good) or coherence[excited].mean() < RELATED * by_chance:
        reason = (
            f"the coherence is {coherence[excited].mean():.2g} in the mean, as of unrelated columns: the "
            "position does not follow the force; are the columns of one run, and of one time, has a sign flipped "
            "in between, or one of them stood still?"
        )
        return Check("coherence", False, reason), 0.0
    top, last = float(f[good[-1]]), float(f[excited][-1])
    middle = float(np.median(coherence[excited & (f <= top)]))
    if top < 0.8 * last:
        reason = (
            f"its median is {middle:.3g} up to {top:.4g} Hz; above, up to {last:.4g} Hz, it has collapsed, and "
            "what is there is not used: drive harder there to know more"
        )
        return Check("coherence", False, reason, warning=True), top
    reason = f"its median is {middle:.3g} from {f[excited][0]:.4g} to {last:.4g} Hz"
    return Check("coherence", True, reason), np.inf


def slope_of(spectra: Spectra) -> tuple[float, float]:
    """Exponent of |P| over frequency where the coherence is good, and the ratio of the frequencies that it is
    taken over; 0 and 1 for fewer than eight lines."""
    value, coherence = spectra.response("force", "position"), spectra.coherence("force", "position")
    good = (coherence > TRUSTED) & (np.abs(value) > 0.0)
    f = spectra.frequency[good]
    if len(f) < 8:
        return 0.0, 1.0
    weight = 1.0 / np.sqrt(f)  # lines crowd at high frequencies: alike for each octave
    return float(np.polyfit(np.log(f), np.log(np.abs(value[good])), 1, w=weight)[0]), float(f[-1] / f[0])


def order_check(slope: float, ratio: float, names: tuple[str, str]) -> Check:
    """Check that force and position, columns `names`, are not swapped: a response falls over frequency, its
    inverse rises.

    slope, ratio  of `slope_of`
    """
    # over less than two octaves the flank of a resonance rises as steeply
    swapped = slope > RISING and ratio > 4.0
    reason = f"the response goes with frequency to the power {slope:.2g}"
    if swapped:
        reason += f"; that of a mass falls, with the power -2: are the columns {names[0]} and {names[1]} swapped?"
    return Check("causality", not swapped, reason)


def feedback_check(force: Floats, position: Floats, period: float, free: bool) -> Check:
    """Check that the force does not follow the position, as that of a centring spring does.

    Where nothing else excites the device, such a force leaves U/Y = -k, whatever the device is: a constant,
    against the position. No device without feedback has this at the lowest frequencies: a free mass has -m w^2,
    which grows with the square of the frequency, a spring to the ground has +k. A device on a spring is not
    checked, nor is a stretch too short or still.

    force, position  (n,) a stretch, sampled every `period` [s];   free  whether the device has a motion without a
                     spring
    """
    window = np.hanning(len(force))
    U, Y = (np.fft.rfft((values - values.mean()) * window)[LOWEST] for values in (force, position))
    passed = Check("feedback", True, "the force does not follow the position at the lowest frequencies")
    if not free or len(U) < 8 or np.any(Y == 0.0):
        return passed
    against = -U / Y
    k = float(np.median(against.real))
    f = np.array([LOWEST.start, LOWEST.stop - 1]) / (len(force) * period)
    if k > 0.0 and np.median(np.abs(against / k - 1.0)) < CONSTANT:
        reason = (
            f"from {f[0]:.3g} to {f[1]:.3g} Hz the force follows the position as that of a spring of {k:.3g} N/m "
            "does: a loop centres the device, and the noise that it feeds back would be taken for the device "
            "(H1 is biased then); record what was added to the loop's command, as reference_N or reference_Nm"
        )
        return Check("feedback", False, reason)
    return passed


def sign_and_unit_checks(
    spectra: Spectra, excited: Flags, value: Complexes, own: Complexes, turns: bool
) -> list[Check]:
    """Check the response (n,) against that of the device as its file has it: its sign, and whether the units are
    plausible; [] where fewer than four lines can be trusted.

    excited  (n,) lines with force;   value  (n,) response [m/N]
    own      (n,) response of the device at the spectra's frequencies;   turns  under a torque
    """
    coherence = spectra.coherence("force", "position")
    good = np.flatnonzero(excited & (coherence > TRUSTED) & (np.abs(value) > 0.0))
    if len(good) < 4:
        return []
    # the lowest eighth of the lines, and four at least
    lowest = good[: max(4, len(good) // 8)]
    ratio = value[lowest] / own[lowest]
    size = float(np.median(np.abs(ratio)))
    cosine = float(np.median(np.cos(np.angle(ratio))))
    f = spectra.frequency[lowest]
    where = f"from {f[0]:.3g} to {f[-1]:.3g} Hz"
    checks = []
    # within 45 degrees of the opposite phase
    if cosine < -0.7:
        reason = f"{where} the position moves against the force; turn the sign of one of the columns"
        checks.append(Check("sign", False, reason))
    else:
        checks.append(Check("sign", True, f"{where} the position moves with the force, as the device's does"))
    for factor, unit in (FACTORS_TURN if turns else FACTORS_LINEAR).items():
        if max(size / factor, factor / size) < NEAR:
            reason = (
                f"{where} the response is {size:.4g} times that of the device file: is the position in {unit}?"
            )
            # the entries of a factor below 1 speak of the force too, and do not end on a unit of the position
            if not unit.endswith("s"):
                reason = f"{where} the response is {size:.4g} times that of the device file: is {unit}?"
            checks.append(Check("units", False, reason + " Columns are in N, m, N m, rad."))
            return checks
    reason = f"{where} the response is {size:.3g} times that of the device file"
    far = max(size, 1.0 / max(size, 1e-300)) > IMPLAUSIBLE
    if far:
        reason += ": check the units of both columns, and the masses in the file"
    checks.append(Check("units", not far, reason, warning=far))
    return checks


def flip_check(gains: Sequence[tuple[str, float]]) -> Check:
    """Check that stretches of a record, and records, have one sign.

    gains  what each stretch is, and how many times as far as by the first one's response it moves
    """
    turned = [(what, times) for what, times in gains if times < FLIPPED]
    if turned:
        what, times = turned[0]
        reason = (
            f"{what} moves {times:.2g} times as far as the first one does under the same force: the sign of force "
            "or position was turned between the runs; turn it back, or leave the run out"
        )
        return Check("runs agree", False, reason)
    if len(gains) < 2:
        return Check("runs agree", True, "there is one stretch, and no other to compare it with")
    least, most = (extreme(times for _, times in gains) for extreme in (min, max))
    reason = f"all {len(gains)} stretches move as the first does, {least:.3g} to {most:.3g} times as far"
    return Check("runs agree", True, reason)


def shift_check(low: float, high: float, misfit: float) -> Check:
    """Check that the position does not move before the force is commanded.

    low, high  interval of the delay [samples]
    misfit     of the modes it is from, in standard deviations: where they do not explain the response, as that of
               a device with friction, a small shift says nothing
    """
    early = high < (EARLY if misfit < EXPLAINED else -1.0)
    reason = f"the position follows the force after {low:.3g} to {high:.3g} samples"
    if early:
        reason = (
            f"the position moves {-high:.3g} to {-low:.3g} samples before the force is commanded: the rows of "
            "both columns are shifted against each other; write in each row the reading and the force sent "
            "after it"
        )
    return Check("delay", not early, reason)


def resolution_check(fit: ModalFit, line: float) -> Check:
    """Check that each resonance is wider than what a stretch tells apart, twice the distance `line` [Hz]."""
    f, width = fit.rates / (2.0 * np.pi), 2.0 * fit.ratios * fit.rates / (2.0 * np.pi)
    narrow = np.flatnonzero(width < 2.0 * line)
    if not len(f):
        return Check("resolution", True, f"lines are {line:.3g} Hz apart")
    if len(narrow):
        i = int(narrow[np.argmin(width[narrow])])
        reason = (
            f"the resonance at {f[i]:.4g} Hz is {width[i]:.2g} Hz wide, lines are {line:.2g} Hz apart: its "
            f"damping is known from few lines; record {2.0 / max(width[i], 1e-12):.3g} s without a gap, or more"
        )
        return Check("resolution", False, reason, warning=True)
    reason = f"the narrowest resonance is {width.min():.3g} Hz wide, lines are {line:.2g} Hz apart"
    return Check("resolution", True, reason)


UNLIKE: Final = 1.4  # ratio of the forces of two records that tell of the amplitude
SURE: Final = 4.0  # standard deviations of the sum of squares by which responses differ
SINE: Final = 0.05  # by which a sweep's crest factor may differ from the square root of 2


def amplitude_check(
    by_record: Sequence[RecordResponse], sources: Sequence[Source], levels: Sequence[Levels]
) -> tuple[Check, frozenset[int]]:
    """Compare the responses of records of unlike amplitude; a warning where there are none, or they differ.

    Returns  also the records that are not to be fitted: those of less force, where the response hangs on it
    """
    size = np.array([one.deviation[0] for one in levels])  # of the force
    if len(by_record) < 2 or size.max() < UNLIKE * size.min():
        reason = (
            "one amplitude only: Coulomb friction f_c looks like damping 4 f_c/(pi w X) at amplitude X, and at "
            "small motion like a spring; record a second time with twice the force, and give both files"
        )
        return Check("amplitude", False, reason, warning=True), frozenset()
    small, large = int(np.argmin(size)), int(np.argmax(size))  # records of the least and the largest force
    of_small, of_large = by_record[small], by_record[large]
    known = np.isfinite(of_small.deviation) & np.isfinite(of_large.deviation)
    variance = of_small.deviation[known] ** 2 + of_large.deviation[known] ** 2
    difference = float(np.sum(np.abs(of_small.value[known] - of_large.value[known]) ** 2 / variance))
    count = 2 * int(np.count_nonzero(known))
    relative = float(np.median(np.abs(of_small.value[known] / of_large.value[known] - 1.0))) if count else 0.0
    # "N" of the column force_N, "Nm" of command_Nm
    forces = f"{size[small]:.3g} and {size[large]:.3g} {sources[0].channels.force.partition('_')[2]}"
    # by chance alone the sum has the mean `count` and the variance 2 `count`
    if count == 0 or difference < count + SURE * np.sqrt(2.0 * count):
        return Check(
            "amplitude", True, f"the response is the same at {forces} (standard deviations of the force)"
        ), frozenset()
    reason = f"the response differs by {100.0 * relative:.2g} % in the middle between {forces}: "
    crest = np.array([np.max(np.abs([one.low[0], one.high[0]])) for one in levels]) / np.maximum(size, 1e-300)
    friction = ""
    # of sines alone an amplitude X, and so f_c, is known
    if np.all(np.abs(crest[[small, large]] / np.sqrt(2.0) - 1.0) < SINE):
        f_c = _coulomb_friction(of_small, of_large, known, np.sqrt(2.0) * size[small], np.sqrt(2.0) * size[large])
        friction = f" of about {f_c:.2g} {sources[0].channels.force.partition('_')[2]}" if f_c > 0.0 else ""
    reason += (
        f"friction{friction}, or backlash; only the records of the largest force are fitted, in which it weighs "
        "least; identify friction by itself"
    )
    smaller = frozenset(k for k in range(len(size)) if size[k] * UNLIKE < size[large])
    return Check("amplitude", False, reason, warning=True), smaller


def _coulomb_friction(a: RecordResponse, b: RecordResponse, known: Flags, force_a: float, force_b: float) -> float:
    """Coulomb friction [N] by which two sine sweeps of unlike force differ, by least squares.

    a, b  their responses;   known  bands of both;   force_a, force_b  amplitudes F [N]

    The damper 4 f_c/(pi w X) is 4 f_c/(pi X) in the imaginary part of 1/P, X = |P| F; hold and delay, which turn
    its phase, are left out:   Im (1/P_a - 1/P_b) = 4 f_c/pi (1/X_a - 1/X_b)
    """
    Pa, Pb = a.value[known], b.value[known]
    per_friction = 4.0 / np.pi * (1.0 / (np.abs(Pa) * force_a) - 1.0 / (np.abs(Pb) * force_b))
    found = np.imag(1.0 / Pa - 1.0 / Pb)
    # by the noise of 1/P_a, of the smaller force
    weight = 1.0 / (a.deviation[known] / np.abs(Pa) ** 2) ** 2
    return float(np.sum(weight * per_friction * found) / max(float(np.sum(weight * per_friction**2)), 1e-300))


SEEN: Final = 25.0  # sum of squares, in the noise's variances, by which the hand must change the response


def hand_check(data: RecordResponse, model: SampledModel, point: OperatingPoint) -> Check:
    """Check that a hand as in the file changes the response by more than the noise."""
    alone = sampled_response(without_hand(point), data.theta)
    held = model.response(model.vector(model.start), data.theta)
    change = float(np.sum(data.apply(held - alone) ** 2))
    reason = (
        f"a hand as in the file changes the response by {np.sqrt(change):.3g} standard deviations of its noise"
    )
    if change < SEEN:
        reason += ": the device hides the hand; drive it harder, or at frequencies at which the handle moves"
    return Check("hand", change >= SEEN, reason)


def input_check(channels: Channels) -> Check:
    """Say which column is taken for the command; always passed."""
    if channels.measured:
        text = f"the response is from {channels.force}, what was commanded; {channels.measured} was measured"
    else:
        text = (
            f"{channels.force} is taken for what was commanded and held; if it was measured, give the command as "
            f"command_{channels.force.partition('_')[2]} beside it"
        )
    return Check("input", True, text)


def unfollowed_check(share: float) -> Check:
    """Say that too small a share of the unseen motion follows a force with flat tops."""
    reason = (
        f"only {100.0 * share:.3g} % of the unseen motion follows the force, which has flat tops: another "
        "force acted there than is written; drive less, or write what the amplifier gave"
    )
    return Check("validation", False, reason)


def force_is_clipped(checks: Sequence[Check], sources: Sequence[Source]) -> bool:
    """Whether a force has flat tops and is none that steps between a few levels on purpose."""
    if all(check.passed for check in checks if check.what == "saturation"):
        return False
    first = [one for one in (source.first() for source in sources) if one is not None]
    return any(len(np.unique(one.force[:LEVELS_READ])) > FEW_LEVELS for one in first)
