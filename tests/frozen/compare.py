"""Two answers to one command line, held against each other."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.frozen.curves import distance
from tests.frozen.rules import FIRST_SAMPLES, QUANTISED, ROUNDING, SHAPE, SMOOTHNESS, Kind, Rule, rule_of

UNIT = re.compile(r"_((?:N2s|Nms|Nm|Ns|N|kg|m|J|Hz|s|rad|deg)(?:_per_[A-Za-z0-9]+)?)$")
NUMBERS = re.compile(r"(?<=[\[ ,:])-?\d")
PROGRESS = re.compile(r"zwidth: [a-z ]+(,.*|: \d.*)?$")  # what is being computed, after two seconds and later
DEFAULT = Rule("*", "*", Kind.SMOOTH, "a number of a formula, or a converged iteration")


@dataclass(frozen=True)
class Difference:
    """One value that differs more than it may."""

    command: str
    device: str
    key: str
    reason: str


@dataclass
class Tally:
    """What a comparison of many command lines comes to.

    same, same_numbers  documents that are equal to the last character, and the numbers in them
    numbers        how many were compared in the others, by kind
    largest        the largest relative difference, by kind, and where: within tolerance or not
    added          keys that only the second has, by command and key
    reworded       sentences that differ, by command and key
    diverged_runs  command lines of runs that parted
    seconds        processor time of both
    """

    runs: int = 0
    same: int = 0
    same_numbers: int = 0
    differences: list[Difference] = field(default_factory=list)
    numbers: Counter[Kind] = field(default_factory=Counter)
    largest: dict[Kind, tuple[float, str]] = field(default_factory=dict)
    added: Counter[tuple[str, str]] = field(default_factory=Counter)
    reworded: Counter[tuple[str, str]] = field(default_factory=Counter)
    diverged_runs: list[str] = field(default_factory=list)
    seconds: tuple[float, float] = (0.0, 0.0)


def compare(name: str, quantised: bool, base: dict[str, Any], new: dict[str, Any], tally: Tally) -> None:
    """Add the comparison of two answers to a tally.

    name       the command line's, command first
    quantised  may the two runs part?
    """
    tally.runs += 1
    tally.seconds = (tally.seconds[0] + base["seconds"], tally.seconds[1] + new["seconds"])
    if _comparable(name, base, new, tally):
        if base["out"] == new["out"]:
            tally.same += 1
            tally.same_numbers += len(NUMBERS.findall(base["out"]))
            return
        Comparison(name, quantised, tally).documents(json.loads(base["out"]), json.loads(new["out"]))


def _comparable(name: str, base: dict[str, Any], new: dict[str, Any], tally: Tally) -> bool:
    """Is there a document on both sides? Tells what else there is to tell of exit codes and complaints."""
    command, device = name.split(" ", 1)

    def tell(key: str, reason: str) -> bool:
        tally.differences.append(Difference(command, device, key, reason))
        return False

    codes = base["code"], new["code"]
    if "time" in codes:
        times = " and ".join(f"{'more than ' * (a['code'] == 'time')}{a['seconds']:.1f} s" for a in (base, new))
        return tell("time", f"a run that takes too long is not compared: {times}")
    if codes[0] != codes[1]:
        said = (new["err"] or base["err"]).splitlines()
        return tell("exit code", f"{codes[0]} became {codes[1]}: {said[-1] if said else 'no message'}")
    if codes[0] not in (0, 1, 2):
        return tell("exit code", f"{codes[0]} on both sides: {(base['err'].splitlines() or ['no message'])[-1]}")
    if codes[0] == 2:
        lines = [len(faults_of(answer["err"])) for answer in (base, new)]
        if lines[0] != lines[1] or base["out"] != new["out"]:
            tell("lines", f"bad input was refused in {lines[0]} lines, now in {lines[1]}")
        return False
    for answer in (base, new):
        try:
            json.loads(answer["out"], parse_constant=_no_constant)
        except ValueError as error:
            return tell("document", f"standard output is not one strict JSON document: {error}")
    return True


def _no_constant(name: str) -> None:
    raise ValueError(f"{name} is not JSON")


class Comparison:
    """Two documents of one command line."""

    def __init__(self, name: str, quantised: bool, tally: Tally) -> None:
        self._name, self._tally = name, tally
        self._command, self._device = name.split(" ", 1)
        self._quantised, self._parted = quantised, False

    def documents(self, base: dict[str, Any], new: dict[str, Any]) -> None:
        """Compare all."""
        if self._quantised and self._command in ("simulate", "move"):
            self._find_divergence(base, new)
        self._values("", base, new, {})

    def _find_divergence(self, base: dict[str, Any], new: dict[str, Any]) -> None:
        """Find the first sample in which a trace differs; what comes later is compared by its size."""
        first = None
        for key, values in base.items():
            rule = rule_of(self._command, key)
            if rule is None or rule.kind is not Kind.TRACE or not isinstance(new.get(key), list):
                continue
            a, b = _array(values), _array(new[key])
            if a is None or b is None or a.shape[1:] != b.shape[1:]:
                continue
            count = min(len(a), len(b))
            scale = np.nanmax(np.abs(a), initial=0.0)
            apart = np.abs(a[:count] - b[:count]) > rule.tolerance * scale
            samples = np.flatnonzero(apart.reshape(count, -1).any(axis=1)) if count else np.zeros(0, int)
            if samples.size or len(a) != len(b):
                at = int(samples[0]) if samples.size else count
                first = at if first is None else min(first, at)
        if first is None:
            return
        if first < FIRST_SAMPLES:
            self._add_difference("position_m", f"the runs part at sample {first}, before rounding could grow")
        self._parted = True
        self._tally.diverged_runs.append(f"{self._name}: sample {first}")

    def _values(self, key: str, base: Any, new: Any, beside: dict[str, Any]) -> None:
        rule = rule_of(self._command, key) or DEFAULT
        if rule.kind is Kind.IGNORED:
            return
        if rule.kind is Kind.CURVE and isinstance(base, list) and isinstance(new, list):
            self._curves(key, rule, base, new)
        elif isinstance(base, dict) and isinstance(new, dict):
            self._objects(key, base, new)
        elif rule.kind is Kind.PROSE and not (isinstance(base, list) and isinstance(new, list)):
            self._prose(key, base, new)
        elif isinstance(base, list) and isinstance(new, list):
            self._lists(key, rule, base, new, beside)
        elif _is_number(base) and _is_number(new):
            self._numbers(key, rule, np.array(float(base)), np.array(float(new)), beside)
        elif base != new:
            self._add_difference(key, f"{_shown(base)} became {_shown(new)}")

    def _objects(self, key: str, base: dict[str, Any], new: dict[str, Any]) -> None:
        inner = f"{key}." if key else ""
        for name in base.keys() - new.keys():
            self._add_difference(inner + name, "the key is missing")
        for name in new.keys() - base.keys():
            self._tally.added[self._command, inner + name] += 1
        for name in base:
            if name in new:
                beside = _of_unit(base, name, key)
                self._values(inner + name, base[name], new[name], beside)

    def _prose(self, key: str, base: Any, new: Any) -> None:
        if type(base) is not type(new):
            self._add_difference(key, f"{_shown(base)} became {_shown(new)}")
        elif base != new:
            self._tally.reworded[self._command, key] += 1

    def _lists(self, key: str, rule: Rule, base: list[Any], new: list[Any], beside: dict[str, Any]) -> None:
        a, b = _array(base), _array(new)
        if a is not None and b is not None and a.size and (a.shape == b.shape or self._parted):
            self._numbers(key, rule, a, b, beside)
        elif len(base) != len(new):
            self._add_difference(key, f"a list of {len(base)} became one of {len(new)}")
        else:
            for one, other in zip(base, new, strict=True):
                self._values(key, one, other, beside)

    def _numbers(self, key: str, rule: Rule, a: np.ndarray, b: np.ndarray, beside: dict[str, Any]) -> None:
        """Numbers of one key: a and b of one shape, NaN for null."""
        if self._parted:
            a, b = np.array(_peak(a)), np.array(_peak(b))
        if not np.array_equal(np.isnan(a), np.isnan(b)):
            self._add_difference(key, "null stands in other places")
            return
        if self._parted:
            relative, floor = QUANTISED, QUANTISED
        elif rule.kind is Kind.SMOOTH:
            relative, floor = rule.tolerance, ROUNDING
        else:
            relative, floor = 0.0, rule.tolerance
        tolerance = max(relative, floor)
        own = np.nanmax(np.abs(a), initial=0.0)
        scale = max(own, 0.0 if rule.kind is Kind.TRACE else _largest(beside))
        allowed = relative * np.fmax(np.abs(a), np.abs(b)) + floor * scale
        apart = np.abs(a - b)
        # 0 where both are 0
        share = np.divide(apart, allowed, out=np.where(apart > 0.0, np.inf, 0.0), where=allowed > 0.0)
        share = np.nan_to_num(share, nan=0.0, posinf=np.inf)
        self._tally.numbers[rule.kind] += a.size
        worst = np.unravel_index(np.argmax(share), share.shape) if share.ndim else ()
        self._record_largest(rule.kind, float(share[worst]) * tolerance, key)
        if share[worst] > 1.0:
            where = f" at {list(map(int, worst))}" if worst else ""
            size = f"by {share[worst] * tolerance:.1e}, {tolerance:.0e} is allowed"
            self._add_difference(key, f"{float(a[worst])!r} became {float(b[worst])!r}{where}: {size}")

    def _curves(self, key: str, rule: Rule, base: list[Any], new: list[Any]) -> None:
        if len(base) != len(new):
            self._add_difference(key, f"{len(base)} of them became {len(new)}")
            return
        extent: dict[str, float] = {}
        for curve in base:
            for name, values in _columns(curve).items():
                extent[name] = max(extent.get(name, 0.0), float(np.nanmax(np.abs(values), initial=0.0)))
        for index, (one, other) in enumerate(zip(base, new, strict=True)):
            if isinstance(one, dict) and isinstance(other, dict):
                self._objects(key, _labels(one), _labels(other))
            first, second = _columns(one), _columns(other)
            names = [name for name in first if name in second]
            if not names or any(len({len(columns[name]) for name in names}) > 1 for columns in (first, second)):
                self._add_difference(key, f"number {index} has other lists than before")
                continue
            a, b = (
                np.stack([columns[name] / (extent[name] or 1.0) for name in names], axis=-1)
                for columns in (first, second)
            )
            self._tally.numbers[Kind.CURVE] += a.size
            if a.shape == b.shape:
                apart = float(np.nanmax(np.abs(a - b), initial=0.0))
                if apart <= SMOOTHNESS:
                    self._record_largest(Kind.CURVE, apart, key)
                    continue
                # points that moved along the curve by a little must lie on it to all digits
                allowed = rule.tolerance if apart <= SHAPE else max(SHAPE, rule.tolerance)
            else:
                allowed = max(SHAPE, rule.tolerance)
            apart = distance(np.nan_to_num(a), np.nan_to_num(b))
            self._record_largest(Kind.CURVE, apart, key)
            if apart > allowed:
                self._add_difference(
                    key, f"number {index} lies {apart:.1e} of its extent apart, {allowed:.0e} is allowed"
                )

    def _record_largest(self, kind: Kind, apart: float, key: str) -> None:
        if apart > self._tally.largest.get(kind, (0.0, ""))[0]:
            self._tally.largest[kind] = (apart, f"{self._name}: {key}")

    def _add_difference(self, key: str, reason: str) -> None:
        told = Difference(self._command, self._device, key, reason)
        last = self._tally.differences[-1:]
        # one for each key, not for each element of a list
        if not last or (last[0].command, last[0].device, last[0].key) != (told.command, told.device, told.key):
            self._tally.differences.append(told)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _array(value: Any) -> np.ndarray | None:
    """Numbers and nulls in nested lists of one shape; None for anything else."""
    try:
        made = np.array(value, dtype=object)
        if any(isinstance(element, (str, bool, dict, list)) for element in made.flat):
            return None
        return np.array([np.nan if element is None else element for element in made.flat], float).reshape(
            made.shape
        )
    except ValueError:
        return None


def _peak(a: np.ndarray) -> float:
    return float(np.nanmax(np.abs(a))) if np.isfinite(a).any() else float("nan")


def _of_unit(record: dict[str, Any], name: str, key: str) -> dict[str, Any]:
    """What has the same unit as one key of an object; nothing for a number that has none."""
    unit = UNIT.search(name)
    if unit is None:  # as of "ledger_J.hand"
        return record if UNIT.search(key) else {}
    return {
        other: value for other, value in record.items() if (found := UNIT.search(other)) and found[1] == unit[1]
    }


def _largest(value: Any) -> float:
    """The largest number in size, wherever it stands in what is given."""
    if _is_number(value):
        return abs(float(value))
    if isinstance(value, dict):
        return max(map(_largest, value.values()), default=0.0)
    return max(map(_largest, value), default=0.0) if isinstance(value, list) else 0.0


def _labels(arc: dict[str, Any]) -> dict[str, Any]:
    """An arc without its lists: what is compared besides its points."""
    return {key: "a list" if isinstance(value, list) else value for key, value in arc.items()}


def _columns(curve: Any) -> dict[str, np.ndarray]:
    """Coordinates of the points of an arc or a ring, by name; none where it is something else."""
    if isinstance(curve, dict):
        found = {key: _array(value) for key, value in curve.items() if isinstance(value, list)}
        return {key: values for key, values in found.items() if values is not None and values.ndim == 1}
    points = _array(curve)
    if points is None or points.ndim != 2:
        return {}
    return {str(index): column for index, column in enumerate(points.T)}


def _shown(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "..."


def faults_of(messages: str) -> list[str]:
    """The lines of standard error that name a fault, and not those that say what is being waited for."""
    return [line for line in messages.splitlines() if not PROGRESS.match(line)]
