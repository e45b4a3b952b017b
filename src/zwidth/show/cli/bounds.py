"""`zwidth bounds`: what published conditions say, beside the exact answer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from zwidth.questions import BOUNDS
from zwidth.show.cli.answer import answer_table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.options import options_of
from zwidth.show.units import amount, number, typed

if TYPE_CHECKING:
    from zwidth.conditions import Bound
    from zwidth.conditions.comparison import BoundsComparison

# What a condition lacks, for people.
LACKED: Final = {
    "rigid_mass_kg": "a free mass",
    "damping_Ns_per_m": "friction of a free mass",
    "motor_side_mass_kg": "a motor side",
    "stiffness_N_per_m": "a spring behind the motor side",
    "mode_mass_kg": "a single mode",
    "mode_damping_Ns_per_m": "the friction of a single mode",
    "mode_stiffness_N_per_m": "the spring of a single mode",
    "time_constant_s": "a first-order filter",
    "electrical_damping_Ns_per_m": "electrical damping",
    "coulomb_friction_N": "dry friction",
    "resolution_m": "the encoder's step",
}


class BoundsCommand(Command):
    """Compare published conditions on DEVICE with the exact answer, and say which assumptions it does not meet."""

    name = "bounds"
    takes_responses = True
    answers_by_fit = True
    summary = "Compare published conditions on DEVICE with the exact answer."
    examples = (
        "zwidth bounds my-device.toml",
        "zwidth bounds my-device.toml --damping 2 --output bounds.csv",
    )
    options = options_of(BOUNDS)
    keys = (
        "bounds",
        "damping_Ns_per_m",
        "exact_N_per_m",
        "exact_largest_N_per_m",
        "exact_damping_at_largest_Ns_per_m",
    )
    may_be_undecided = True

    def compute(self, case: CommandLine) -> BoundsComparison:
        return case.point.bounds(case["damping"])

    def pages(self, case: CommandLine, result: BoundsComparison, document: Mapping[str, Any]) -> Iterator[Any]:
        """The exact answer, a row for each condition that speaks, and what the others lack."""
        yield two_columns(list(_exact_rows(result)))
        speaking = [bound for bound in result.bounds if not bound.lacking]
        # the assumptions not met, in the order in which they come up, numbered from 1
        unmet = list(dict.fromkeys(sentence for bound in speaking for sentence in bound.violated))
        headings = [
            "condition",
            "claims",
            f"at {amount(result.damping, 'N s/m')}",
            "ratio to exact",
            "largest",
            "not met",
        ]
        yield answer_table(headings, [_row(result, bound, unmet) for bound in speaking])
        if unmet:
            yield "not met here:"
            yield two_columns([(f"{n}", sentence) for n, sentence in enumerate(unmet, start=1)])
        silent = [(bound.name, _lacking_text(bound)) for bound in result.bounds if bound.lacking]
        if silent:
            yield "not applied, because the device lacks what they need:"
            yield two_columns(silent)


def _exact_rows(comparison: BoundsComparison) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on the exact answer: the largest stiffness at the damping compared, and of all."""
    if comparison.chart is None:
        yield "exact", f"undecided: {comparison.undecided}"
        return
    yield f"exact, at {amount(comparison.damping, 'N s/m')}", _stiffness_text(comparison.exact)
    at = f" at {amount(comparison.damping_at_largest, 'N s/m')}" if comparison.largest > 0.0 else ""
    yield "exact, largest", _stiffness_text(comparison.largest) + at


def _row(comparison: BoundsComparison, bound: Bound, unmet: list[str]) -> tuple[str, ...]:
    """Cells of one condition in the table of `pages`.

    unmet  assumptions that the device does not meet; a cell names those of this condition by their numbers from 1
    """
    ratio = comparison.ratio(bound)  # nan where the exact largest stiffness is 0, or either is not known
    return (
        bound.name,
        f"{bound.kind}, {bound.claim}",
        _stiffness_text(comparison.stiffness_max(bound)),
        "-" if ratio != ratio else typed(number(ratio)),
        _stiffness_text(bound.stiffness_max),
        " ".join(str(unmet.index(sentence) + 1) for sentence in bound.violated) or "-",
    )


def _stiffness_text(value: float) -> str:
    """A largest stiffness [N/m] in words; "-" for nan, of which nothing is said, "none" where none is admitted."""
    if value != value:  # nan
        return "-"
    return amount(value, "N/m") if value > 0.0 else "none"


def _lacking_text(bound: Bound) -> str:
    """What a condition needs and the device lacks, in words."""
    return ", ".join(LACKED.get(name, name) for name in bound.lacking)
