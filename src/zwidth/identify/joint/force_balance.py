"""Whether a recorded force depends on a joint's motion at all, and on its acceleration, beyond its own noise.

Output error (`fit`) takes the recorded force as exact. Under a constant force all numbers of a joint may be
multiplied by one factor without any change of its motion, and the noise of the force's reading then chooses the
factor: the larger the mass, the less that noise moves it. So a mass is believed only where the force, regressed
the other way round on the motion, goes with the acceleration:

    f = m a + b v + F_f [v > 0] - F_b [v < 0] + k x + d f' + drift

Noise of the force is in the left side here, and draws no number anywhere; noise of the position draws the mass
towards 0. Neither makes a mass out of nothing more often than the level of the test says.

`reason_of_misfit` says why no mass with friction explains a motion: a sense reversed, records that differ, perhaps
columns swapped. `checks_of` checks a record of one joint's motion before friction or mass is fitted to it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, isnan
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.device.faults import comma_list, plural
from zwidth.identify.identification import Check
from zwidth.identify.joint.fit import COUNT, MASS, ONE, STIFFNESS, JointNumbers, Windows, explained, squares_of
from zwidth.identify.joint.joint import Joint
from zwidth.identify.joint.motion import DRY_BACKWARD, DRY_FORWARD, VISCOUS_BACKWARD, VISCOUS_FORWARD
from zwidth.identify.joint.record import JointMotion
from zwidth.identify.joint.start import MOVING, PARTLY, SHORTEST, force_balance_rows, search_guess, weighting
from zwidth.identify.profile_likelihood import LEVEL
from zwidth.identify.records.record import Record

BY_CHANCE: Final = 5e-4  # probability that noise alone passes for a mass: a larger one tells masses that are none
OVERLAP: Final = 2.0  # rows that share each sample: so many fewer of them are independent
MEMORY: Final = 0.1  # share of the rows over which errors may go together: with less, slow noise seems to be none
FEWEST_FREE: Final = 3.0  # degrees of freedom below which a variance says little
NUMBERS: Final = (MASS, VISCOUS_FORWARD, DRY_FORWARD, DRY_BACKWARD, STIFFNESS)  # columns of a balance
TINY: Final = 1e-9  # share of the largest column below which one is rounding


@dataclass(frozen=True)
class ForceBalance:
    """The recorded force regressed on the motion.

    values      (10,) numbers as `fit.JointNumbers` has them, 0 where the balance has none
    covariance  (10, 10) of their errors
    freedom     degrees of freedom of its variance
    critical    standard errors from which a mass is told from 0
    depends     whether the force depends on acceleration, velocity, direction or position at all; None where too
                few segments hold motion to say so
    """

    values: Floats
    covariance: Floats
    freedom: float
    critical: float
    depends: bool | None

    @property
    def mass_over_error(self) -> float:
        """Standard errors by which the mass differs from 0."""
        error = float(np.sqrt(self.covariance[MASS, MASS]))
        return float(self.values[MASS]) / error if error > 0.0 else 0.0

    @property
    def tells_mass(self) -> bool:
        """Whether the force grows with the acceleration beyond its own noise."""
        return self.mass_over_error > self.critical

    @property
    def against_mass(self) -> bool:
        """Whether the force falls with the acceleration beyond its own noise, as it does for no mass."""
        return self.mass_over_error < -self.critical

    def interval(self, weights: Floats) -> tuple[float, float]:
        """Ends of the 95 % interval of a sum over the numbers, weights (10,)."""
        from scipy.stats import t

        value = float(weights @ self.values)
        half = float(np.sqrt(weights @ self.covariance @ weights) * t.ppf(0.5 + 0.5 * LEVEL, self.freedom))
        return value - half, value + half


NOTHING: Final = ForceBalance(np.zeros(COUNT), np.zeros((COUNT, COUNT)), 1.0, np.inf, None)


def force_balance(windows: Windows, resolution: float, *, delay: float = 0.0, spring: bool = True) -> ForceBalance:
    """The balance over segments of the length, and with the share of motion, at which it says most of the mass;
    `depends` where any of those tried does.

    resolution  of the readings [m or rad];   delay  of the force [s];   spring  whether one may act
    Returns     `NOTHING` where too few segments hold motion
    """
    if not len(windows.first):
        return NOTHING
    late = max(round(delay / float(np.mean(windows.period))), 0)
    sizes = [SHORTEST]
    while 2 * sizes[-1] <= np.max(windows.length):
        sizes.append(2 * sizes[-1])
    choices = [(size, moving) for size in sizes for moving in (MOVING, PARTLY)]
    # the best of several balances is taken: each has a share of the level
    level = BY_CHANCE / len(choices)
    tried = [_balance_over(windows, size, resolution, late, spring, moving, level) for size, moving in choices]
    found = [one for one in tried if one is not None]
    if not found:
        return NOTHING
    best = max(found, key=lambda one: abs(one.mass_over_error) / one.critical)
    return replace(best, depends=any(one.depends or one.tells_mass or one.against_mass for one in found))


def _balance_over(
    windows: Windows, size: int, resolution: float, late: int, spring: bool, moving: float, level: float
) -> ForceBalance | None:
    """The balance over segments of `size` samples; None of too few segments.

    late    delay of the force [samples];   resolution, spring  as in `force_balance`;   moving  share of a
            segment that must be motion
    level   probability with which noise alone passes for a mass, or for a force that depends on the motion
    """
    from scipy.stats import f as f_distribution
    from scipy.stats import t

    if size > np.max(windows.length):
        return None
    weight, slope, _ = weighting(size)
    columns, samples, T = force_balance_rows(windows, size, resolution, moving)
    # a force is held from its sample to the next: its mean about a sample is that of two
    forces = 0.5 * (windows.force + np.append(windows.force[:1], windows.force[:-1]))
    held = forces[np.clip(samples - late, 0, len(forces) - 1)]
    force, rate = held @ weight, (held @ slope) / T
    # what tells nothing of the joint: a constant force, one that is late, one that drifts
    beside = np.stack(
        [np.full(len(force), np.sum(weight)), rate, *(d[samples] @ weight for d in windows.drifts)], axis=1
    )
    motion = columns[:, : len(NUMBERS) if spring else -1]  # the last column is the spring's
    # without the constant force, which the levels of dry friction in both directions hold
    inverse, remains, rank = _least_squares(np.concatenate([motion, beside[:, 1:]], axis=1), force)
    freedom = len(force) / OVERLAP - rank
    if freedom < FEWEST_FREE:
        return None
    # F test of the motion's columns; while the joint stands partly, a constant force is none of the levels
    _, left_with, rank_with = _least_squares(np.concatenate([motion, beside], axis=1), force)
    _, left_without, rank_without = _least_squares(beside, force)
    added, squares_with = rank_with - rank_without, float(left_with @ left_with)
    gain = float(left_without @ left_without) - squares_with
    depends = added > 0 and gain * freedom > added * f_distribution.ppf(1.0 - level, added, freedom) * squares_with
    numbers = list(NUMBERS[: motion.shape[1]])
    values, covariance = np.zeros(COUNT), np.zeros((COUNT, COUNT))
    values[numbers] = (inverse @ force)[: len(numbers)]
    covariance[np.ix_(numbers, numbers)] = _covariance(inverse[: len(numbers)], remains, freedom)
    for one, other in _tied_numbers(motion):
        values[one] = values[other]
        covariance[one] = covariance[other]
        covariance[:, one] = covariance[:, other]
    return ForceBalance(values, covariance, freedom, float(t.ppf(1.0 - level, freedom)), bool(depends))


def _tied_numbers(motion: Floats) -> list[tuple[int, int]]:
    """(index, other) of numbers that are set to another: viscous friction backward, and dry friction of a
    direction in which nothing slid.

    motion  (s, c) columns of `NUMBERS`
    """
    pairs = [(VISCOUS_BACKWARD, VISCOUS_FORWARD)]
    forward, backward = (np.any(motion[:, NUMBERS.index(dry)] != 0.0) for dry in (DRY_FORWARD, DRY_BACKWARD))
    return pairs + (
        [(DRY_BACKWARD, DRY_FORWARD)] if not backward else [] if forward else [(DRY_FORWARD, DRY_BACKWARD)]
    )


def _least_squares(X: Floats, y: Floats) -> tuple[Floats, Floats, int]:
    """Inverse (p, n) of columns X (n, p), the remainder (n,) of y that they do not explain, and their rank; a
    column of 0 gets a row of 0."""
    length = np.linalg.norm(X, axis=0)
    scale = np.where(length > 0.0, length, 1.0)
    if not len(y):
        return np.zeros(X.T.shape), y, 0
    U, s, Vt = np.linalg.svd(X / scale, full_matrices=False)
    seen = s > TINY * s[0]
    U = U[:, seen]
    return (Vt[seen].T / s[seen]) @ U.T / scale[:, None], y - U @ (U.T @ y), int(np.sum(seen))


def _covariance(inverse: Floats, remainder: Floats, freedom: float) -> Floats:
    """Covariance (p, p) of numbers that `inverse` (p, n) makes of a force, whose noise is like the remainder (n,):
    of one size over the record, and correlated over neighbouring rows; no less than if rows were independent.

    The autocovariances are weighted with a triangle (Newey and West 1987, known at second hand).

    freedom  degrees of freedom of the remainder, rows that overlap counted as fewer
    """
    n = len(remainder)
    variance = float(remainder @ remainder) / max(freedom * OVERLAP, 1.0)
    independent = variance * inverse @ inverse.T
    correlated = independent.copy()
    reach = max(int(MEMORY * n), 4)
    share = variance / max(float(remainder @ remainder), 1e-300)
    for lag in range(1, min(reach, n - 1) + 1):
        together = share * float(remainder[lag:] @ remainder[:-lag]) * (1.0 - lag / (reach + 1.0))
        products = inverse[:, lag:] @ inverse[:, :-lag].T
        correlated += together * (products + products.T)
    wider = np.sqrt(np.maximum(np.diag(correlated) / np.maximum(np.diag(independent), 1e-300), 1.0))
    return np.asarray(independent * wider[:, None] * wider[None, :])


GROUPS: Final = 6  # parts of a single record
FEWEST: Final = 3  # windows of a part
CLEARLY: Final = 0.9  # share of the motion that is explained where the cause is right
SWAPPED: Final = 0.995  # the same of swapped columns, for two smooth ones explain each other in part
BETTER: Final = 0.1  # share of what remains that may remain with the right cause
GUESSES: Final = 3  # that are followed
MOST: Final = 6  # windows that are looked at of each part


def reason_of_misfit(
    windows: Windows, motion: JointMotion, numbers: JointNumbers, records: Sequence[Record]
) -> str:
    """What was seen where no mass with friction explains the motion, and what may cause it; "" where nothing was.

    A sign is called turned only where the force falls with the acceleration beyond its noise, and the motion is
    explained once it is turned. Everything else that is better so than as recorded is a question.
    """
    if not motion.driven:
        return ""
    name, opposite = motion.force_name, replace(windows, force=-windows.force)
    groups = groups_of(windows, motion, records)
    balances = {group: force_balance(windows.chosen(which), motion.resolution) for group, which in groups.items()}
    along, against, explained_alone = list[str](), list[str](), list[str]()
    for group, which in groups.items():
        left = 1.0 - _explained_at_best(windows.chosen(_few_of(which)), motion, numbers)
        left_opposite = 1.0 - _explained_at_best(opposite.chosen(_few_of(which)), motion, numbers)
        if left <= 1.0 - CLEARLY:
            explained_alone.append(group)
        if min(left, left_opposite) > 1.0 - CLEARLY:
            continue
        if left_opposite < BETTER * left and balances[group].against_mass:
            against.append(group)
        elif left < BETTER * left_opposite and balances[group].tells_mass:
            along.append(group)
    if against and along:
        return (
            f"a positive {name} accelerates backward in {comma_list(against)}, and forward in "
            f"{comma_list(along)}: a sign has flipped, change it there"
        )
    everywhere = np.ones(len(windows.first), dtype=bool)
    if against or (not along and _sign_is_turned(windows, opposite, motion, numbers)):
        return f"a positive {name} accelerates backward: change the sign of one of the two columns"
    if len(records) > 1 and len(explained_alone) == len(groups):
        return f"each record by itself is explained, all together are not: {_masses_by_record(balances)}"
    swapped = replace(windows, position=windows.force, force=windows.position + motion.reference)
    share = _explained_at_best(swapped.chosen(_few_of(everywhere)), motion, numbers)
    if share > SWAPPED:
        return (
            f"were the columns of position and {name} swapped, {100.0 * share:.4g} % would be explained: are "
            "they, or did another force act too, or something change while it was recorded? The record does not "
            "tell"
        )
    return ""


def _sign_is_turned(windows: Windows, opposite: Windows, motion: JointMotion, numbers: JointNumbers) -> bool:
    """Whether the force of the whole record falls with the acceleration, and explains the motion with its sign
    turned.

    opposite  the windows with the force's sign turned
    """
    if not force_balance(windows, motion.resolution).against_mass:
        return False
    some = _few_of(np.ones(len(windows.first), dtype=bool))
    left, left_opposite = (
        1.0 - _explained_at_best(one.chosen(some), motion, numbers) for one in (windows, opposite)
    )
    return left_opposite <= 1.0 - CLEARLY and left_opposite < BETTER * left


def _masses_by_record(balances: Mapping[str, ForceBalance]) -> str:
    """The mass by each record, and what may be the reason where they differ."""
    masses = list[str]()
    for group, balance in balances.items():
        low, high = balance.interval(ONE[MASS])
        masses.append(f"{low:.3g} to {high:.3g} by {group}" if balance.tells_mass else f"not told by {group}")
    return (
        f"the mass or inertia is {comma_list(masses)}; another device or load, another friction, or another unit "
        "or sign in one of them? Give them one by one"
    )


def _explained_at_best(windows: Windows, motion: JointMotion, numbers: JointNumbers) -> float:
    """Share of the motion in windows that is explained by the numbers that explain it best."""
    found, starts = search_guess(windows, numbers, motion.resolution, motion.deviation, GUESSES)
    return explained(windows, squares_of(windows, found, starts))


def _few_of(which: Flags) -> Flags:
    """At most `MOST` of the windows that `which` (W,) marks, evenly spread: marks (W,)."""
    places = np.flatnonzero(which)
    kept = places[np.unique(np.linspace(0, len(places) - 1, min(MOST, len(places))).astype(int))]
    return np.isin(np.arange(len(which)), kept)


def groups_of(windows: Windows, motion: JointMotion, records: Sequence[Record]) -> dict[str, Flags]:
    """Windows of each record, or of parts of a single one, by their names; those of `FEWEST` and more."""
    record_of_run = {one.run: one.record for one in motion.sections}
    owner = np.array([record_of_run[int(run)] for run in windows.run])
    if len(records) > 1:
        groups = {record.label: owner == n for n, record in enumerate(records)}
    else:
        groups = {}
        for part in np.array_split(np.arange(len(owner)), max(min(GROUPS, len(owner) // FEWEST), 1)):
            end = windows.time[part[-1]] + windows.length[part[-1]] * windows.period[part[-1]]
            groups[f"{windows.time[part[0]]:.4g} to {end:.4g} s"] = np.isin(np.arange(len(owner)), part)
    return {name: which for name, which in groups.items() if np.sum(which) >= FEWEST}


FEWEST_COUNTS: Final = 10.0  # steps of the encoder
FEWEST_WINDOWS: Final = 4  # with motion
ONE_WAY: Final = 0.03  # share of the travel that must go the other way
STUCK, MOSTLY_STUCK = 0.97, 0.6  # share of the windows in which nothing moves
# units in which a position may be recorded by mistake, and how many times larger its numbers are then
SLIPS: Final = (("degrees", 180.0 / np.pi), ("a thousandth of the unit", 1000.0), ("a millionth of it", 1e6))
SLIP: Final = 0.1  # relative difference of a ratio from one of these
FAR: Final = 20.0  # times the drive's largest torque: no command, but another unit
LONGEST: Final = 5.0  # m, of a travel
MOST_TURNS: Final = 1000.0  # rad, of a motor's travel
FLAT: Final = 0.02  # share of a force's samples at its largest or smallest value
FEW_LEVELS: Final = 50  # values of a force that is meant to have flat tops, as square waves have


def checks_of(motion: JointMotion, windows: Windows, joint: Joint) -> list[Check]:
    """All checks of what was recorded, in an order in which each assumes those before it; the later
    ones only where these passed."""
    checks = [check_joint_motion(motion, joint), check_units(motion, joint)]
    if not checks[0].passed:
        return checks
    if motion.force_name:
        checks.append(check_force(motion, joint))
    checks.append(check_amount(windows))
    if all(check.passed or check.warning for check in checks):
        checks.append(check_directions(windows, motion))
        checks.append(check_standstill(motion))
        checks += check_saturation(motion, joint)
    return checks


def check_joint_motion(motion: JointMotion, joint: Joint) -> Check:
    """That the joint moves, by more than ten steps of its encoder, or times its noise where no steps show."""
    travel, unit = float(np.ptp(motion.positions)), joint.unit("position")
    if travel == 0.0:
        return Check("motion", False, f"{joint.position} is constant; record the joint while it moves")
    counts = travel / motion.resolution if motion.resolution > 0.0 else inf
    seen = f"{joint.position} travels {travel:.4g} {unit}"
    what = f"steps of {motion.step:.4g} {unit}" if motion.step else f"times its noise of {motion.noise:.2g} {unit}"
    if counts < FEWEST_COUNTS:
        return Check(
            "motion",
            False,
            f"{seen}, only {counts:.3g} {what}; {FEWEST_COUNTS:.0f} are needed: move the joint farther",
        )
    return Check("motion", True, f"{seen}, {counts:.3g} {what}" if isfinite(counts) else seen)


def check_units(motion: JointMotion, joint: Joint) -> Check:
    """That travel, encoder steps and forces are of the size that the device's own numbers give."""
    travel, unit = float(np.ptp(motion.positions)), joint.unit("position")
    faults, seen = list[str](), list[str]()
    if motion.step and not isnan(joint.step):
        ratio = motion.step / joint.step
        slip = _unit_slip(ratio, angular=joint.angular)
        said = (
            f"readings go in steps of {motion.step:.4g} {unit}, those of the file's encoder are {joint.step:.4g}"
        )
        if slip:
            faults.append(f"{said}: {joint.position} looks like {slip}; record it in {unit}")
        else:
            seen.append(said)
    room = joint.upper - joint.lower
    if isfinite(room) and travel > 3.0 * room:
        faults.append(
            f"{joint.position} travels {travel:.4g} {unit}, the file's limits leave {room:.4g}; is it in {unit}?"
        )
    if not joint.angular and travel > LONGEST:
        faults.append(f"position_m travels {travel:.4g} m; is it in millimetres, or swapped with the force?")
    if joint.angular and travel > MOST_TURNS:
        faults.append(f"angle_rad travels {travel:.4g} rad; is it in degrees, or in counts?")
    if motion.driven and isfinite(joint.limit):
        peak, force = float(np.max(np.abs(motion.forces))), joint.unit("force")
        said = f"{motion.force_name} reaches {peak:.4g} {force}, the drive's limit is {joint.limit:.4g}"
        if peak > FAR * joint.limit:
            faults.append(f"{said}: is it in m{force.replace(' ', '')}? multiply by 0.001")
        else:
            seen.append(said)
    if faults:
        return Check("units", False, "; ".join(faults))
    return Check("units", True, "; ".join(seen) or "the file has no numbers that readings could be compared with")


def _unit_slip(ratio: float, *, angular: bool) -> str:
    """Unit in which readings seem to be, by the ratio of their step to the file's; "" where it is no such unit."""
    for name, factor in SLIPS:
        if (name == "degrees") <= angular and abs(ratio / factor - 1.0) < SLIP:
            return name
    return ""


def check_force(motion: JointMotion, joint: Joint) -> Check:
    """That the force changes: under a constant one only ratios of friction and mass can be told; a warning
    where it is 0 throughout, which counts as free motion."""
    forces, unit = motion.forces, joint.unit("force")
    if not motion.driven:
        return Check(
            "force",
            False,
            f"{motion.force_name} is 0 throughout: taken as free motion",
            warning=True,
        )
    low, high = float(np.min(forces)), float(np.max(forces))
    if high - low <= 1e-3 * max(abs(low), abs(high)):
        return Check(
            "force",
            False,
            f"{motion.force_name} stays at {high:.4g} {unit}; under a constant force friction and mass are told "
            "only up to a factor: record one that changes in size and sign",
        )
    return Check("force", True, f"{motion.force_name} from {low:.4g} to {high:.4g} {unit}")


def check_dependence(balance: ForceBalance, motion: JointMotion) -> list[Check]:
    """That the force depends on the motion beyond its own noise; [] where it does."""
    if balance.depends is None:
        reason = (
            f"too little of the motion is sliding to see whether {motion.force_name} goes with it, or is constant "
            "but for its noise, when friction and mass are told only up to a factor; record longer, or push harder"
        )
        return [Check("force", False, reason)]
    if balance.depends:
        return []
    return [
        Check(
            "force",
            False,
            f"{motion.force_name} varies by no more than its own noise, in no way that goes with the motion: "
            "under a constant force friction and mass are told only up to a factor; step it, or reverse it",
        )
    ]


def check_amount(windows: Windows) -> Check:
    """That there are windows with motion to fit and to validate on."""
    count = len(windows.first)
    if count < FEWEST_WINDOWS:
        return Check(
            "length",
            False,
            f"{plural(count, 'stretch', 'stretches')} with motion, {FEWEST_WINDOWS} are needed; record longer, or "
            "repeat the motion",
        )
    return Check("length", True, f"{count} windows with motion, of {int(np.median(windows.length))} samples")


def travels(windows: Windows, resolution: float) -> tuple[float, float]:
    """Travel forward and backward in all windows, without what moves by less than two steps [m or rad].

    resolution  a step [m or rad]
    """
    forward = backward = 0.0
    for first, length in zip(windows.first, windows.length, strict=True):
        y = windows.position[first : first + length]
        # some 50 readings of a window, so that slow motion is more than two steps between them
        y = y[:: max(int(length) // 50, 1)]
        moves = np.diff(y)
        moves = moves[np.abs(moves) > 2.0 * resolution]
        forward += float(np.sum(moves[moves > 0.0]))
        backward -= float(np.sum(moves[moves < 0.0]))
    return forward, backward


def directions(windows: Windows, motion: JointMotion) -> tuple[bool, bool]:
    """Whether the joint slides forward, and backward, by enough to tell friction there; where it goes farther, it
    always does."""
    forward, backward = travels(windows, motion.resolution)
    least = max(ONE_WAY * (forward + backward), FEWEST_COUNTS * motion.resolution)
    return forward >= least or forward > backward, backward >= least or backward > forward


def check_directions(windows: Windows, motion: JointMotion) -> Check:
    """That the joint slides both ways: a constant force and friction are one otherwise."""
    both = directions(windows, motion)
    if all(both):
        return Check("directions", True, "the joint slides forward and backward")
    way = "forward" if both[0] else "backward"
    return Check(
        "directions",
        False,
        f"the joint slides {way} only: dry friction cannot be told from a constant force such as gravity's; "
        "record motion in both directions",
        warning=True,
    )


def check_standstill(motion: JointMotion) -> Check:
    """How long the joint stands: its friction then hides force and mass."""
    shares = []
    for one in motion.sections:
        # samples in which a joint that slides moves by more than a step of its reading
        reach = max(8, len(one.position) // 400)
        moved = np.abs(one.position[reach:] - one.position[:-reach])
        shares.append((len(moved), float(np.mean(moved <= 1.5 * motion.resolution)) if len(moved) else 1.0))
    share = float(np.average([s for _, s in shares], weights=[max(n, 1) for n, _ in shares]))
    text = f"{100.0 * share:.0f} % of the samples are at rest, where friction hides the force"
    if share > STUCK:
        return Check("standstill", False, f"{text}; push harder, so that the joint slides for most of the time")
    if share > MOSTLY_STUCK:
        return Check("standstill", False, f"{text}; a larger force tells more", warning=True)
    return Check("standstill", True, text)


def check_saturation(motion: JointMotion, joint: Joint) -> list[Check]:
    """Whether the force has flat tops, or lies beyond what the drive gives; [] of free motion."""
    if not motion.driven:
        return []
    forces, unit, name = motion.forces, joint.unit("force"), motion.force_name
    peak = float(np.max(np.abs(forces)))
    beyond = float(np.mean(np.abs(forces) > 1.001 * joint.limit))
    if beyond:
        return [
            Check(
                "saturation",
                False,
                f"{name} is beyond the drive's limit of {joint.limit:.4g} {unit} in {100.0 * beyond:.2g} % of the "
                "samples, where another force acted; those are limited as the drive limits them",
                warning=True,
            )
        ]
    # a force of few levels, as binary noise, is at its largest on purpose
    levels = len(np.unique(forces[:200_000]))
    flat = max(float(np.mean(forces == np.max(forces))), float(np.mean(forces == np.min(forces))))
    if flat > FLAT and levels > FEW_LEVELS:
        return [
            Check(
                "saturation",
                False,
                f"{name} stays at its largest or smallest value, {peak:.4g} {unit}, in {100.0 * flat:.2g} % of "
                "the samples: if the amplifier or the recorder was saturated there, another force acted; record "
                "with a smaller one",
                warning=True,
            )
        ]
    return [Check("saturation", True, f"{name} has no flat tops")]
