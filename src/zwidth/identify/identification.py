"""What was identified: the checks that the data passed, the numbers with their intervals, and the validation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, inf, isfinite, log10, nan
from typing import Any

from zwidth.errors import NoAnswerError
from zwidth.result import Documented, Result, documented, entry, finite
from zwidth.unit_text import unit_text


@dataclass(frozen=True)
class Check(Documented):
    """One thing that the data must be, before anything is fitted.

    what     is checked, a noun: "motion"
    passed   whether the data are so
    reason   what was seen of it, and where it failed what to record instead
    warning  it failed, and the fit is made all the same: a remark that a reader must see
    """

    what: str = field(metadata=entry())
    passed: bool = field(metadata=entry())
    reason: str = field(metadata=entry())
    warning: bool = False


@dataclass(frozen=True)
class Estimate(Documented):
    """A number with the interval that holds it with 95 %.

    name   what it is, a noun: "backlash"
    value  best estimate
    low, high  ends of the interval; -inf or inf where the data set no bound
    unit   in words as users read it; "" for a share
    path   of the number in the device file, as `--set` takes it; "" where the file has no such key
    told   "yes"; "only a sum", of numbers that the data do not tell apart; or "no", with a value of nan
    reason  why not, where it is not "yes"
    within  key of the file's matrix whose entries the number makes, as a spring's stiffness does; with a path: it
            is one of these entries; "" where it belongs to none
    """

    name: str = field(metadata=entry())
    value: float = field(metadata=entry(value=finite))
    low: float = field(metadata=entry(value=finite))
    high: float = field(metadata=entry(value=finite))
    unit: str = field(metadata=entry())
    path: str = field(default="", metadata=entry(empty="null", before="value"))
    within: str = ""
    told: str = field(default="yes", metadata=entry())
    reason: str = field(default="", metadata=entry(empty="null"))


@dataclass(frozen=True, repr=False)
class Identification(Result):
    """Numbers of a device from measurements of it.

    kind         of measurement: "stiffness", "modes", ...
    label        the device, for people
    checks       in the order in which they were made
    estimates    the numbers; () where a check refuses the data
    validation   share of the unseen part's motion (or torque) that is explained: 1 minus the residual's variance
                 over the signal's; nan where nothing was fitted, or nothing was left to predict
    validated_on what the unseen part was, and how it was predicted, a sentence
    remarks      sentences about what was seen beside the numbers
    curves       columns of what was measured and fitted, for figures and .csv, by kind
    details      further numbers of the kind, keys and values of --json
    """

    kind: str = field(metadata=entry())
    label: str
    checks: tuple[Check, ...] = field(metadata=entry(name="check"))
    estimates: tuple[Estimate, ...] = field(default=(), metadata=entry(name="parameters"))
    validation: float = field(default=nan, metadata=entry())
    validated_on: str = field(default="", metadata=entry())
    remarks: tuple[str, ...] = field(default=(), metadata=entry())
    curves: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict, metadata=entry(spread=True))

    @property
    def reason(self) -> str | None:
        """Why nothing was fitted; None where something was."""
        if self.estimates:
            return None
        failed = [f"{check.what}: {check.reason}" for check in self.checks if not (check.passed or check.warning)]
        return "; ".join(failed) or "the data tell no number"

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of this name or path. Raises NoAnswerError where none has it."""
        for estimate in self.estimates:
            if name in (estimate.name, estimate.path):
                return estimate
        names = ", ".join(estimate.path or estimate.name for estimate in self.estimates)
        raise NoAnswerError(f"{name!r} was not identified: {self.reason or f'identified are {names}'}")

    @property
    def listed(self) -> tuple[Estimate, ...]:
        """The numbers that a table lists: a spring or a damper, not each entry of a matrix that it makes."""
        return tuple(one for one in self.estimates if not (one.path and one.within))

    @property
    def settings(self) -> dict[str, float]:
        """Path -> value of all numbers that a device file holds, as `Device.with_` takes them.

        Raises NoAnswerError  where no device file may get them, see `not_written`
        """
        if self.not_written:
            raise NoAnswerError(self.not_written)
        return {one.path: one.value for one in self.estimates if one.path and one.told != "no"}

    @property
    def not_written(self) -> str:
        """Why no device file gets these numbers; "" where one may."""
        return ""

    @property
    @documented(before="details")
    def left_out(self) -> tuple[str, ...]:
        """Sources of error that the intervals leave out, sentences."""
        return ()

    @property
    @documented(before="details")
    def premises(self) -> tuple[Mapping[str, Any], ...]:
        """Premises of the numbers: `what` each is, whether it `holds` (True, False, None), `how` it was seen."""
        return ()

    def table(self) -> Mapping[str, Any]:
        """Columns of what was measured and fitted."""
        return self.curves

    def __repr__(self) -> str:
        lines = [f"Identification of {self.kind}, {self.label}"]
        if self.reason:
            return "\n".join([*lines, f"  nothing fitted: {self.reason}"])
        for one in self.listed:
            if one.told == "no":
                lines.append(f"  {one.path or one.name} is not told: {one.reason}")
                continue
            lines.append(
                f"  {one.path or one.name} = {estimate_text(one)}, {interval(one)} {unit_text(one.unit)}".rstrip()
            )
        lines += [f"  {text}" for text in self.left_out]
        return "\n".join([*lines, f"  validation {self.validation:.4g} ({self.validated_on})"])


def interval(estimate: Estimate) -> str:
    """The interval of an estimate in words, its ends with as many digits as tell them apart.

    >>> interval(Estimate("mass", 0.1, 0.05, inf, "kg")), interval(Estimate("mass", 0.1, 0.09996, 0.10004, "kg"))
    ('above 0.05', '0.09996 to 0.10004')
    """
    digits = _digits(estimate)
    low, high = f"{estimate.low:.{digits}g}", f"{estimate.high:.{digits}g}"
    if estimate.low == -inf and estimate.high == inf:
        return "without bound"
    if estimate.low == -inf:
        return f"below {high}"
    return f"above {low}" if estimate.high == inf else f"{low} to {high}"


def estimate_text(estimate: Estimate) -> str:
    """The value with the digits of its interval; in words where it is not told."""
    if estimate.told == "no":
        return "not told"
    return f"{estimate.value:.{_digits(estimate)}g}"


def written_value(estimate: Estimate) -> float:
    """The value as a device file gets it: two digits more than its interval tells."""
    return float(f"{estimate.value:.{_digits(estimate) + 2}g}")


def _digits(estimate: Estimate) -> int:
    """Significant digits with which a value is written: the last two differ between the ends of its interval."""
    width = estimate.high - estimate.low
    largest = max((abs(one) for one in (estimate.low, estimate.high) if isfinite(one)), default=0.0)
    if not isfinite(width) or width <= 0.0 or largest == 0.0:
        return 4
    return min(max(2 + ceil(log10(largest / width)), 2), 12)


def refused(kind: str, label: str, checks: Sequence[Check]) -> Identification | None:
    """The identification that a failed check leaves, without numbers; None where the data may be fitted."""
    if all(check.passed or check.warning for check in checks):
        return None
    return Identification(kind, label, tuple(checks))
