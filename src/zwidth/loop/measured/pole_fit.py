"""The poles of a measured device, so that its responses go on beyond half the sampling rate.

Modes are added one by one where the data miss one most, each time all poles and the delay fitted together by
variable projection: they by least squares, the residues of every path linearly (Golub and Pereyra 1973, known at
second hand). Every path falls like 1/w^2 in the end, as masses do.

Responses of single modes: continuous, and sampled behind hold and delay. Time is in sampling periods.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import floor
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats

# The paths of a device by output and input: what is read at the sensor s or the handle h, of a command or actuator
# a, or of a force at the handle h.
PATHS: Final = ("sa", "sh", "ha", "hh")

MOST_MODES: Final = 8
DELAYS: Final = (0.2, 0.8, 1.5, 3.0)  # samples, from which the search begins
KEPT: Final = 2  # of the searches, once they have a few modes
EXACT: Final = 1e-6  # relative misfit at which no mode is missing
GAIN: Final = 0.95  # of the misfit before, above which a mode more explains nothing
RATIOS: Final = (0.001, 0.005, 0.02, 0.08, 0.3, 1.0)  # damping ratios of modes tried
TRIED: Final = 40  # frequencies of modes tried, beside the peaks of what is left
PEAKS: Final = 8  # of those, the highest
HIGHEST: Final = 1.9 * np.pi  # angle of the fastest mode: at 2 pi the hold hides it
LARGEST_DELAY: Final = 200.0  # samples
POINTS: Final = 300  # by which poles are found
STEPS: Final = 25  # of each search from a start
STEP: Final = 1e-6  # relative, of derivatives


@dataclass(frozen=True)
class PathData:
    """What was measured: angles (k,), values by path (k,), and the standard deviation of each (k,) or a size.

    integrators  poles at z = 1
    delay        known delay [samples]; None: to be fitted
    """

    theta: Floats
    values: Mapping[str, Complexes]
    deviations: Mapping[str, Floats]
    integrators: int
    delay: float | None

    def thinned(self, most: int) -> PathData:
        """The data at every n-th point, at most `most` of them."""
        every = slice(None, None, max(1, -(-len(self.theta) // most)))
        return replace(
            self,
            theta=self.theta[every],
            values={name: value[every] for name, value in self.values.items()},
            deviations={name: value[every] for name, value in self.deviations.items()},
        )


@dataclass(frozen=True)
class PoleModel:
    """Modes common to all paths, with residues of each.

    modes        (n, 2) angle w and damping ratio; w = 0: of a mass on a dashpot, its rate of decay in place of the
                 ratio
    delay        of commands [samples]
    free         whether there is a free mass without damping, 1/s², beside them
    residues     by path, of the atoms of `mode_atoms`
    misfit       root of the mean square of the weighted deviations
    delay_deviation  standard deviation of the delay [samples], 0 of a known one
    """

    modes: Floats
    delay: float
    free: bool
    residues: Mapping[str, Floats]
    misfit: float
    delay_deviation: float

    def sampled(self, name: str, theta: Floats, delay: float | None = None) -> Complexes:
        """Response (k,) of a path from commands at angles in (0, pi]; `delay` other than its own [samples]."""
        late = self.delay if delay is None else delay
        return np.asarray(mode_atoms(self.modes, self.free, theta, late) @ self.residues[name])

    def continuous(self, name: str, theta: Floats) -> Complexes:
        """Response (k,) of any path at angles, of commands before hold and delay."""
        return np.asarray(mode_atoms(self.modes, self.free, theta, None) @ self.residues[name])

    def scaled(self, ratio: float, added_delay: float) -> PoleModel:
        """The same device in sampling periods that are `ratio` times as long, its commands later by a delay [of
        the new periods]."""
        modes = self.modes.copy()
        modes[:, 0] *= ratio
        modes[modes[:, 0] == 0.0, 1] *= ratio
        # atoms of 1/s² first, then those of 1/s
        squared = int(self.free) + len(modes)
        residues = {
            name: np.append(values[:squared] * ratio**2, values[squared:] * ratio)
            for name, values in self.residues.items()
        }
        return replace(self, modes=modes, residues=residues, delay=self.delay / ratio + added_delay)

    def hold(self, theta: Floats) -> Complexes:
        """W of hold and delay at angles, of any size."""
        return hold_response(theta, self.delay)


def fit_poles(data: PathData) -> PoleModel:
    """The modes, as few as explain the data, the delay, and the residues of each path."""
    few = data.thinned(POINTS)
    _, delay, modes = _search(few)
    if len(few.theta) < len(data.theta):
        modes, delay = _refine(data, modes, delay)
    residues, rest = {}, []
    for name, value in data.values.items():
        atoms = stacked(_path_atoms(data, name, modes, delay), data.deviations[name])
        scale = np.maximum(np.linalg.norm(atoms, axis=0), 1e-300)
        target = stacked(value, data.deviations[name])
        residues[name] = np.linalg.lstsq(atoms / scale, target, rcond=1e-11)[0] / scale
        rest.append(target - atoms @ residues[name])
    misfit = float(np.sqrt(np.mean(np.concatenate(rest) ** 2)))
    spread = 0.0 if data.delay is not None else _delay_deviation(data, modes, delay, misfit)
    return PoleModel(modes, delay, data.integrators == 2, residues, misfit, spread)


def _search(data: PathData) -> tuple[float, float, Floats]:
    """Misfit, delay and modes of the best of searches from several delays, each with a mode more than before until
    two in a row explain nothing, the misfit is EXACT, or there are MOST_MODES."""
    # one pole at z = 1: a mass on a dashpot, whose decay is looked for from ten times the lowest angle
    first = np.array([[0.0, 10.0 * data.theta[0]]]) if data.integrators == 1 else np.zeros((0, 2))
    # all are (misfit, delay, modes)
    states = [(np.inf, delay, first) for delay in (DELAYS if data.delay is None else (data.delay,))]
    if data.integrators:
        states = _until_exact(data, [(modes, delay) for _, delay, modes in states])
    kept = sorted(states, key=lambda one: one[0])
    best, misses = kept[0], 0
    while best[0] > EXACT and len(kept[0][2]) < MOST_MODES and misses < 2:
        kept = _until_exact(data, [(_with_a_mode(data, modes, delay), delay) for _, delay, modes in kept])
        # with one mode only all starts stay: it does not tell yet which of them is best
        kept = sorted(kept, key=lambda one: one[0])[: KEPT if len(kept[0][2]) > 1 else None]
        misses = 0 if kept[0][0] < GAIN * best[0] else misses + 1
        best = kept[0] if misses == 0 else best
    return best


def _until_exact(data: PathData, starts: Sequence[tuple[Floats, float]]) -> list[tuple[float, float, Floats]]:
    """(Misfit, delay, modes) of searches from starts (modes, delay), up to the first that misses less than
    EXACT."""
    found: list[tuple[float, float, Floats]] = []
    for modes, delay in starts:
        found.append(_refined_with_misfit(data, modes, delay))
        if found[-1][0] < EXACT:
            break
    return found


def _refined_with_misfit(data: PathData, modes: Floats, delay: float) -> tuple[float, float, Floats]:
    """Misfit, delay and modes (n, 2) after `_refine`, from modes and a delay."""
    modes, delay = _refine(data, modes, delay)
    return float(np.sqrt(np.mean(_unexplained(data, modes, delay) ** 2))), delay, modes


def mode_atoms(modes: Floats, free: bool, theta: Floats, delay: float | None) -> Complexes:
    """Responses (k, 2 n - 1) of unit residue, and one more of the free mass.

    First the free mass, 1/s², then each mode, 1/((s - s1)(s - s2)), then these times s, less that of the first:
    all of them together fall like 1/s².

    modes  (n, 2) and free as of `PoleModel`;   theta  (k,) angles
    delay  of commands, sampled behind a hold; None: continuous
    """
    parts = []
    if free:
        mass = -1.0 / theta**2 + 0j if delay is None else sampled_free_mass(theta, delay)
        parts.append(mass[:, None])
    if len(modes):
        w, ratio = modes.T
        rate = np.where(w == 0.0, ratio / 2.0, w * ratio)
        root = np.sqrt((rate**2 - w**2).astype(complex))
        nearest = 1e-7 * np.maximum(w, rate)  # two equal poles are taken as little apart
        root = np.where(np.abs(root) < nearest, nearest, root)
        # the roots of s² + 2 rate s + w², 0 and -ratio of a mass on a dashpot
        s1, s2 = np.where(w == 0.0, 0.0, -rate + root), -rate - root
        both = np.concatenate([s1, s2])
        terms = continuous_terms(both, theta) if delay is None else sampled_terms(both, theta, delay)
        first, second = terms[:, : len(w)], terms[:, len(w) :]
        faster = (s1 * first - s2 * second) / (s1 - s2)
        parts += [(first - second) / (s1 - s2), faster[:, 1:] - faster[:, :1]]
    return np.concatenate(parts, axis=1) if parts else np.zeros((len(theta), 0), dtype=complex)


def _path_atoms(data: PathData, name: str, modes: Floats, delay: float) -> Complexes:
    """Atoms (k, .) of a path by its name: those of commands ("a") are held, delayed and sampled."""
    return mode_atoms(modes, data.integrators == 2, data.theta, delay if name[1] == "a" else None)


def stacked(values: Complexes, deviation: Floats) -> Floats:
    """Real, then imaginary parts (2k, ...) of values (k, ...), each over its standard deviation (k,)."""
    weighted = values / deviation.reshape(-1, *[1] * (values.ndim - 1))
    return np.concatenate([weighted.real, weighted.imag])


def _projected(data: PathData, modes: Floats, delay: float) -> list[tuple[Floats, Floats]]:
    """Of each path, in the order of the data, with modes (n, 2) as of `PoleModel` and a delay [samples]: an
    orthonormal basis (2k, r) of its atoms, and what they leave (2k,) of its values, both weighted and
    `stacked`."""
    parts = []
    inputs = {name[1]: name for name in data.values}  # any path from each input: atoms hang on it alone
    of_input = {letter: _path_atoms(data, name, modes, delay) for letter, name in inputs.items()}
    for name, value in data.values.items():
        atoms = stacked(of_input[name[1]], data.deviations[name])
        atoms = atoms / np.maximum(np.linalg.norm(atoms, axis=0), 1e-300)
        basis = np.linalg.qr(atoms)[0] if atoms.shape[1] else atoms
        target = stacked(value, data.deviations[name])
        parts.append((basis, target - basis @ (basis.T @ target)))
    return parts


def _unexplained(data: PathData, modes: Floats, delay: float) -> Floats:
    """What the atoms of these modes leave of all paths' values, weighted, in one row (2k paths,)."""
    return np.concatenate([rest for _, rest in _projected(data, modes, delay)])


def _refine(data: PathData, modes: Floats, delay: float) -> tuple[Floats, float]:
    """Modes and delay, searched from these, that leave the least of the data by least squares."""
    from scipy.optimize import least_squares

    fixed = data.delay is not None
    moving = modes[:, 0] > 0.0

    def unpack(x: Floats) -> tuple[Floats, float]:
        """Modes (n, 2) and delay [samples] of the fitted numbers: the modes' logarithms, then a free delay."""
        new = np.exp(x[: 2 * len(modes)].reshape(-1, 2))
        new[~moving, 0] = 0.0  # a mass on a dashpot stays one: its decay alone is fitted
        return new, delay if fixed else float(x[-1])

    x0 = np.log(np.where(modes == 0.0, 1.0, modes)).ravel()
    # bounds of a mode's angle, from far below the data to HIGHEST, and of its damping ratio or decay
    low = np.tile([np.log(data.theta[0] / 30.0), np.log(1e-6)], len(modes))
    high = np.tile([np.log(HIGHEST), np.log(50.0)], len(modes))
    if not fixed:
        x0, low, high = np.append(x0, delay), np.append(low, 0.0), np.append(high, LARGEST_DELAY)
    if not len(x0):
        return modes, delay
    x0 = np.clip(x0, low + 1e-9, high - 1e-9)
    found = least_squares(
        lambda x: _unexplained(data, *unpack(x)), x0, bounds=(low, high), max_nfev=STEPS, x_scale=0.1, ftol=1e-5
    )
    return unpack(found.x)


def _delay_deviation(data: PathData, modes: Floats, delay: float, misfit: float) -> float:
    """Standard deviation of the fitted delay [samples]: the misfit over the part of its slope that no change of
    the modes' numbers makes up for."""
    base, columns = _unexplained(data, modes, delay), []
    for i in range(modes.size):
        if modes.flat[i] > 0.0:
            changed = modes.copy()
            changed.flat[i] *= 1.0 + STEP
            columns.append((_unexplained(data, changed, delay) - base) / STEP)
    late = (_unexplained(data, modes, delay + STEP) - base) / STEP
    if columns:
        others = np.array(columns).T
        others /= np.maximum(np.linalg.norm(others, axis=0), 1e-300)
        left, size, _ = np.linalg.svd(others, full_matrices=False)
        basis = left[:, size > 1e-9 * size[0]]
        late = late - basis @ (basis.T @ late)
    return float(misfit / max(float(np.linalg.norm(late)), 1e-300))


def _with_a_mode(data: PathData, modes: Floats, delay: float) -> Floats:
    """The modes (n + 1, 2) with the one more that takes most of what the n modes leave of the data, at a delay
    [samples] that stays."""
    parts = _projected(data, modes, delay)
    k = len(data.theta)
    # power per angle that is left, at whose peaks modes are tried beside a grid of angles
    left = np.sum([rest[:k] ** 2 + rest[k:] ** 2 for _, rest in parts], axis=0)
    inner = np.flatnonzero((left[1:-1] >= left[:-2]) & (left[1:-1] >= left[2:])) + 1
    peaks = data.theta[inner[np.argsort(-left[inner])[:PEAKS]]]
    w = np.concatenate([np.geomspace(data.theta[0], HIGHEST, TRIED), peaks])
    tried = np.array([(angle, ratio) for angle in w for ratio in RATIOS])
    gain = np.zeros(len(tried))
    for (basis, rest), name in zip(parts, data.values, strict=True):
        first = mode_atoms(tried, False, data.theta, delay if name[1] == "a" else None)[:, : len(tried)]
        atoms = stacked(first, data.deviations[name])
        whole = np.einsum("ij,ij->j", atoms, atoms)
        atoms -= basis @ (basis.T @ atoms)
        size = np.einsum("ij,ij->j", atoms, atoms)
        # what a projection on one atom more takes off the square of the rest; nothing of one that the others span
        gain += np.where(size > 1e-16 * whole, (rest @ atoms) ** 2 / np.maximum(size, 1e-300), 0.0)
    return np.vstack([modes, tried[np.argmax(gain)]])


def hold_response(theta: Floats, delay: float) -> Complexes:
    """W_0 = (1 - e^-jw)/(jw) e^(-jw d) of hold and delay at angles (k,)."""
    return np.asarray(np.sinc(theta / (2.0 * np.pi)) * np.exp(-1j * theta * (0.5 + delay)))


def continuous_terms(poles: Complexes, theta: Floats) -> Complexes:
    """1/(jw - s) (k, n) of poles s (n,) at angles (k,)."""
    return np.asarray(1.0 / (1j * theta[:, None] - poles))


def sampled_terms(poles: Complexes, theta: Floats, delay: float) -> Complexes:
    """1/(jw - s) behind hold and delay [samples], as sampled, (k, n), of poles s (n,) at angles (k,).

    z^-l [E(1 - f) + e^(s (1 - f)) E(f)/z]/(z - e^s),      E(t) = (e^(s t) - 1)/s,   delay = l + f
    """
    whole = floor(delay)
    f = delay - whole
    z = np.exp(1j * theta)[:, None]
    new, old = _held(poles, 1.0 - f), np.exp(poles * (1.0 - f)) * _held(poles, f)
    # z - e^s without the cancellation of slow poles at low frequency; fast ones have nothing to lose
    slow = np.where(poles.real < -1.0, 0.0, poles)
    apart = np.where(poles.real < -1.0, z - np.exp(poles), np.exp(slow) * np.expm1(1j * theta[:, None] - slow))
    return np.asarray(np.exp(-1j * theta * whole)[:, None] * (new + old / z) / apart)


def sampled_free_mass(theta: Floats, delay: float) -> Complexes:
    """1/s² behind hold and delay [samples], as sampled (k,) at angles (k,)."""
    whole = floor(delay)
    f = delay - whole
    z, d = np.exp(1j * theta), np.expm1(1j * theta)
    # place and speed that the new force leaves after a period, in which it acts for 1 - f, and the old one
    new, old = np.array([(1.0 - f) ** 2 / 2.0, 1.0 - f]), np.array([f * (1.0 - f / 2.0), f])
    place, speed = new[0] + old[0] / z, new[1] + old[1] / z
    return np.asarray(z**-whole * (place / d + speed / d**2))


def _held(poles: Complexes, t: float) -> Complexes:
    """E(t) = (e^(s t) - 1)/s (n,); t at s = 0."""
    zero = poles == 0.0
    return np.where(zero, t, np.expm1(poles * t) / np.where(zero, 1.0, poles))
