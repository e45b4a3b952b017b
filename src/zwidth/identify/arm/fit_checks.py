"""Checks of the fit of a mechanism's torques, with what a reader is told where one fails.

`TorqueComparison` makes what is fitted: torques, and the torque per unit of each parameter, in the analysed band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.faults import comma_list
from zwidth.errors import NoAnswerError
from zwidth.identify.arm.estimates import ConsistentLinks, mass_columns
from zwidth.identify.arm.parameters import BaseParameters
from zwidth.identify.arm.regression import Regression
from zwidth.identify.arm.smoothing import TorqueBand, convolved
from zwidth.identify.arm.stretches import TorqueStretch
from zwidth.identify.identification import Check
from zwidth.model.continuation import moved_posture
from zwidth.model.inertia_regressor import inertia_regressor
from zwidth.model.mechanism import REVOLUTE

FEWEST: Final = 25  # torques of all joints that are compared for each base parameter: fewer make narrow intervals
CAUSES: Final = (
    "noise of the positions (counts, jitter of the time, rows that repeat, vibration), a motion too slow for "
    "inertia to show, gravity that is not stated, or a column with another sign or order may do this, and the "
    "record does not tell which"
)
UNSEEN: Final = 10  # samples to validate, at least
WORSE: Final = 3.0  # deviations per base parameter by which a consistent set may miss
POOR: Final = 0.5  # share explained, below which a reader is warned
WRONG: Final = -0.2  # share below which nothing is given: noise alone makes it no less than about 0
GRAVITY: Final = 0.3  # share of the unexplained torque that gravity explains, from which it is told
REMAINDER: Final = 0.3  # the same of other friction, and of a drift
SLOW: Final = 0.1  # share of the usual speed over which friction at low speed falls
LEAST_OTHER: Final = 1e-6  # share of a column that must not be in the others
LAGS: Final = 16  # of the errors' autocovariances
SHIFT: Final = 0.5  # sampling periods by which torques may run ahead, or behind


def length_check(seen: Sequence[Compared], validation: Sequence[Compared], base: BaseParameters) -> Check:
    """Check that there are enough torques to fit, those of `seen`, and enough samples to validate."""
    count = sum(one.torques.size for one in seen)
    samples = sum(len(one.time) for one in validation)
    wanted = FEWEST * len(base.kept)
    if count < wanted or samples < UNSEEN:
        reason = f"{count} torques in the analysed band to fit {len(base.kept)} parameters, {wanted} are needed"
        return Check(
            "length",
            False,
            f"{reason}, and {UNSEEN} samples to validate, of which there are {samples}; record longer",
        )
    return Check("length", True, f"{count} torques in the analysed band to fit, {samples} samples to validate")


def excitation_check(fit: Regression, base: BaseParameters, beta: Floats) -> Check:
    """Check which inertial parameters, of the values beta (b,), the record tells from 0: refused where it tells
    none, a warning where it does not tell some."""
    inertial = [k for k, j in enumerate(base.kept) if j < base.parameters.friction.start]
    deviations = fit.deviations
    # whose 95 % interval holds 0
    loose = [k for k in inertial if 1.96 * deviations[k] > abs(beta[k])]
    seen = f"{len(base.kept)} base parameters, condition number {fit.condition:.3g}"
    if len(loose) == len(inertial):
        reason = f"{seen}; no mass or inertia is known to better than 100 %"
        return Check("excitation", False, f"{reason}; accelerate every joint more, and more of them together")
    if loose:
        named = comma_list([base.names[k] for k in loose], 6)
        reason = f"{seen}; not told from 0: {named}"
        return Check("excitation", False, f"{reason}; move more joints together, faster", warning=True)
    return Check("excitation", True, f"{seen}; all are known to better than 100 %")


def positive_check(
    drives: Sequence[str], base: BaseParameters, beta: Floats, angles: Floats, known_rotors: Floats
) -> Check | None:
    """Check that no drive sees a negative inertia; None where none does.

    beta  (b,) base parameters;   angles  (n,) joint coordinates;   known_rotors  as in `TorqueComparison`
    """
    values = np.zeros(len(base.parameters.names))
    values[list(base.kept)] = beta
    inertial = base.parameters.friction.start
    M = mass_columns(base.parameters, angles) @ values[:inertial] + np.diag(known_rotors)
    wrong = [name for name, own in zip(drives, np.diag(M), strict=True) if own < 0.0]
    if not wrong:
        return None
    reason = f"the inertia seen by {comma_list(wrong)} comes out negative, which none is"
    return Check("inertia", False, f"{reason}: {CAUSES}")


def timing_check(fit: Regression, period: float, torque: str) -> Check:
    """Check that torques act when they are recorded.

    period  of the records [s];   torque  "measured" or "commanded"
    """
    shift, deviation = fit.delay, fit.delay_deviation
    seen = f"torques act {abs(shift):.2g} s (+-{2.0 * deviation:.1g} s) {'after' if shift > 0.0 else 'before'} "
    # a shift within four deviations may be chance
    if abs(shift) < SHIFT * period or abs(shift) < 4.0 * deviation:
        return Check("timing", True, f"{seen}their time stamps, within half a period")
    advice = "correct the loop's delay" if torque == "commanded" else 'if they are commands, torque = "commanded"'
    reason = f"{seen}their time stamps; the fit allows for it, up to a few periods; {advice}"
    return Check("timing", False, reason, warning=True)


def gravity_check(seen: Sequence[Compared], fit: Regression, beta: Floats) -> Check | None:
    """Check that what a fit without gravity leaves does not depend on the posture as gravity does: a warning where
    much of it does, else None.

    seen  what was fitted, with `static` columns;   beta  (b,) base parameters
    """
    best = np.append(beta, fit.delay)
    residual = np.concatenate([one.torques - one.columns @ best for one in seen])
    scale = np.std(residual, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    residuals = (residual / scale).reshape(-1)
    X = (np.concatenate([one.columns for one in seen]) / scale[:, None]).reshape(len(residuals), -1)
    G = (np.concatenate([one.static for one in seen]) / scale[:, None]).reshape(len(residuals), -1)
    # less their part along the fitted columns, by which the fit could have taken it up
    size = np.linalg.norm(X, axis=0)
    Q = np.linalg.qr(X / np.where(size > 0.0, size, 1.0))[0]
    G = G - Q @ (Q.T @ G)
    residuals = residuals - Q @ (Q.T @ residuals)
    if not np.any(G):
        return None
    directions, singular, _ = np.linalg.svd(G, full_matrices=False)
    # without those that are rounding
    directions = directions[:, singular > 1e-6 * singular[0]]
    share = float(np.sum((directions.T @ residuals) ** 2) / max(float(residuals @ residuals), 1e-300))
    # of less than five torques a direction much is explained by chance
    if share < GRAVITY or len(residuals) < 5 * directions.shape[1]:
        return None
    reason = f"{100.0 * share:.3g} % of the unexplained torque depends on the posture as gravity's does"
    return Check("gravity", False, f"{reason}; state gravity, as gravity = (0, 0, -9.81)", warning=True)


def remainder_check(
    drives: Sequence[str], seen: Sequence[Compared], base: BaseParameters, best: Floats
) -> Check | None:
    """Check that no friction of another kind, and no drift, makes up much of what is left of a joint's torque;
    None where none does.

    best  (b + 1,) base parameters, and the delay of the torques [s]
    """
    torques, columns = (np.concatenate([getattr(one, name) for one in seen]) for name in ("torques", "columns"))
    time = np.concatenate([one.time for one in seen])
    causes = list[str]()
    for i, drive in enumerate(drives):
        names = [f"coulomb({drive})", f"viscous({drive})"]
        # friction that was not fitted tells no other kind from it
        if not {*names} <= {*base.names}:
            continue
        X, torque = columns[:, i], torques[:, i]
        # torque per unit of dry and of viscous friction: the rate's sign, and the rate
        sign, rate = (X[:, base.names.index(name)] for name in names)
        slow = np.exp(-np.abs(rate) / max(SLOW * float(np.std(rate)), 1e-300))
        further = {
            "friction that grows with the torque": sign * np.abs(torque),
            "friction that grows at low speed": sign * slow,
            "friction that changes in time": sign * (time - np.mean(time)),
            "an offset that drifts": time - np.mean(time),
        }
        shares = _shares_explained(X, torque - X @ best, list(further.values()))
        most = int(np.argmax(shares))
        if shares[most] > REMAINDER:
            causes.append(f"{100.0 * shares[most]:.3g} % of that of {drive} goes with {list(further)[most]}")
    if not causes:
        return None
    reason = f"of the torque that is left unexplained, {comma_list(causes)}"
    advice = "the model has none, so numbers may miss by more than their intervals"
    return Check("remainder", False, f"{reason}; {advice}", warning=True)


def _shares_explained(X: Floats, residual: Floats, further: Sequence[Floats]) -> Floats:
    """Share (k,) of the squares of a residual (n,), of a fit by columns X (n, p), that each of k further columns
    (n,) explains by its part across X; 0 of one that is nearly a sum of X."""
    size = np.linalg.norm(X, axis=0)
    Q = np.linalg.qr(X[:, size > 0.0] / size[size > 0.0])[0]
    others = np.stack([column / max(float(np.linalg.norm(column)), 1e-300) for column in further], axis=1)
    others, unexplained = others - Q @ (Q.T @ others), residual - Q @ (Q.T @ residual)
    squares = np.sum(others**2, axis=0)
    told = squares > LEAST_OTHER
    total = max(float(unexplained @ unexplained), 1e-300)
    return np.where(told, (others.T @ unexplained) ** 2 / np.where(told, squares, 1.0) / total, 0.0)


def consistency_check(links: ConsistentLinks) -> Check:
    """Check that links that can exist have the fitted base parameters, to within their uncertainty."""
    if links.deviation < WORSE:
        reason = f"links that can exist have these base parameters, to {links.deviation:.2g} deviations"
        return Check("physical consistency", True, reason)
    reason = (
        f"the nearest links that can exist miss the base parameters by {links.deviation:.3g} deviations; "
        "the model or the torques are wrong by more than noise"
    )
    return Check("physical consistency", False, reason, warning=True)


def validation_check(drives: Sequence[str], shares: Sequence[float], edge: float) -> Check:
    """Check that torques which were not fitted are predicted; refused where no prediction at all would be better,
    else always a warning.

    What is compared has passed a low pass, and the accelerations are the recorded ones: a high share is no proof
    of the numbers, and no reason to call them right.

    shares  of each drive's unseen torque that is explained;   edge  of the band in which they are compared [Hz]
    """
    listed = comma_list([f"{name} {100.0 * share:.4g} %" for name, share in zip(drives, shares, strict=True)])
    if min(shares) > POOR:
        return Check(
            "validation",
            False,
            f"of the unseen torque up to {edge:.3g} Hz are explained: {listed}; by the accelerations of the "
            "record, noise included: that does not show that the inertias are right",
            warning=True,
        )
    reason = f"of the unseen torque are explained only: {listed}"
    if min(shares) < WRONG:
        advice = "has a sign flipped in between, or do the torques only shake what the counts cannot show?"
        return Check("validation", False, f"{reason}; {advice}")
    advice = "what acts there is not in the model, or torques are noise"
    return Check("validation", False, f"{reason}; {advice}", warning=True)


PART: Final = 20_000  # smoothed samples whose columns stand in memory at once


@dataclass(frozen=True)
class Compared:
    """Torques of one stretch, n samples.

    record   number of the record
    time     (n,) [s]
    columns  (n, d, b + 1)  torque per unit of each base parameter, and the derivative of the torques
    torques  (n, d)
    static   (n, d, g)  further columns, of gravity along directions in which there is none; g may be 0
    """

    record: int
    time: Floats
    columns: Floats
    torques: Floats
    static: Floats


@dataclass(frozen=True)
class TorqueComparison:
    """How stretches are turned into torques and columns.

    base          the parameters
    band          what is analysed
    gravity       (3,) [m/s²]
    known_rotors  (d,) inertias at the joints of the rotors that are no parameters
    start         (n,) joint coordinates of a posture in the assembly meant
    """

    base: BaseParameters
    band: TorqueBand
    gravity: Floats
    known_rotors: Floats
    start: Floats

    def of(self, stretch: TorqueStretch, static: Sequence[Floats] = ()) -> Compared:
        """The measured torques of a stretch less those of the known rotors, and as columns the torque per unit of
        each base parameter; the last column is the torques' derivative.

        static   gravities (3,) of which further columns are made, the joints at rest
        Raises NoAnswerError  where the mechanism has no posture
        """
        columns, further = list[Floats](), list[Floats]()
        angles = self.first_posture(stretch)
        parameters, kept = self.base.parameters, list(self.base.kept)
        for begin in range(0, len(stretch.time), PART):
            part = stretch.part(slice(begin, begin + PART))
            links, postures = self._link_columns(part, angles, part.rates, part.accelerations, self.gravity)
            all_columns = parameters.columns(links, part.rates, part.accelerations, part.signs)
            columns.append(np.ascontiguousarray(all_columns[:, :, kept]))
            if static:
                still = np.zeros_like(part.rates)
                further.append(
                    np.concatenate([self._link_columns(part, angles, still, still, g)[0] for g in static], axis=2)
                )
            angles = postures[-1]  # the next part begins near the end of this one
        torques = stretch.forces - self.known_rotors * stretch.accelerations
        no_columns = np.zeros((*torques.shape, 0))
        signals = np.concatenate(columns), torques, np.concatenate(further) if static else no_columns
        narrow, step = self.band.narrow, self.band.step
        taps, half, thin = narrow.taps(step), narrow.half(step), self.band.thinning
        columns_in_band, torques_in_band, gravity_columns = (convolved(signal, taps, thin) for signal in signals)
        rate = convolved(torques, narrow.taps(step, 1), thin)
        time = stretch.time[half : len(stretch.time) - half : thin]
        return Compared(
            stretch.record,
            time,
            np.concatenate([columns_in_band, rate[..., None]], axis=2),
            torques_in_band,
            gravity_columns,
        )

    def _link_columns(
        self, stretch: TorqueStretch, angles: Floats, rates: Floats, accelerations: Floats, gravity: Floats
    ) -> tuple[Floats, Floats]:
        """Torques (n, d, 10 w) per unit of each link parameter, and joint coordinates (n, joints), at the
        coordinates of a stretch.

        angles                joint coordinates near the first sample;   gravity  (3,)
        rates, accelerations  (n, d) to take in place of the stretch's own
        Raises NoAnswerError  where the mechanism cannot be
        """
        mech = self.base.parameters.mech
        links, postures, reached = inertia_regressor(
            mech, angles, stretch.coordinates, rates, accelerations, gravity
        )
        if reached < len(stretch.time):
            raise NoAnswerError(self._no_posture_message(stretch, reached))
        return links, postures

    def _no_posture_message(self, stretch: TorqueStretch, row: int) -> str:
        """Message: at which sample, `row` of the stretch, the drives stand where the mechanism cannot be."""
        numbers = ", ".join(f"{value:.4g}" for value in stretch.coordinates[row])
        return f"at {stretch.time[row]:.6g} s the drives stand at {numbers} (rad or m), where no posture leads"

    def first_posture(self, stretch: TorqueStretch) -> Floats:
        """Joint coordinates (n,) at the stretch's first sample. Raises NoAnswerError where no posture is there."""
        mech = self.base.parameters.mech
        driven = mech.joint[-mech.driven :]
        step = stretch.coordinates[0] - mech.to_drive[0] @ self.start[driven]
        if not mech.coupled:  # a turn more or less is the same posture
            turns = mech.kind[driven] == REVOLUTE
            step = np.where(turns, step - 2.0 * np.pi * np.rint(step / (2.0 * np.pi)), step)
        moved = moved_posture(mech, self.start, step)
        if moved is None:
            raise NoAnswerError(self._no_posture_message(stretch, 0))
        # the driven joints where the record has them, turns included
        moved[driven] = np.linalg.solve(mech.to_drive[0], stretch.coordinates[0])
        return moved


def error_sources(
    band: TorqueBand, fit: Regression, seen: Sequence[Compared], noisy: Sequence[Sequence[Compared]]
) -> list[Floats]:
    """Autocovariances (t, d) at the lags 0, 1, ... of what the sources of error make of the residuals: first of
    white noise of the torques, then of noise of the positions, each in a unit of its own.

    noisy  pairs of `_with_noise_of_both_signs`
    """
    taps, thin = band.narrow.taps(band.step), band.thinning
    filtered = np.convolve(taps, taps[::-1])[len(taps) - 1 :: thin]  # white noise behind the kernel
    lags = min(len(filtered), LAGS)
    white = np.tile(filtered[:lags, None], (1, seen[0].torques.shape[1]))
    # 0: the last column, the derivative of the torques, is left out
    best = np.append(fit.values, 0.0)
    by_positions = np.zeros_like(white)
    # strict=False: the last may lack its partner, and is then left out
    for plus, minus in zip(noisy[::2], noisy[1::2], strict=False):
        for one, other in zip(plus, minus, strict=True):
            # half the difference of both signs: to first order what the noise does
            error = 0.5 * ((one.columns - other.columns) @ best)
            for k in range(min(lags, len(error))):
                by_positions[k] += np.sum(error[: len(error) - k] * error[k:], axis=0)
    return [white, by_positions]
