"""How far two answers to one command line may be apart, key by key, and why."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from fnmatch import fnmatchcase


class Kind(Enum):
    """What a value is, and so how two of them are compared.

    EXACT     equal: texts, truth values, keys, lengths of lists, null or not
    SMOOTH    a number that a formula or a converged iteration gives to all digits: |a - b| <= tolerance times
              the larger of both, and ROUNDING times its scale
    ITERATED  a number at which an iteration stops: |a - b| <= tolerance times its scale
    CURVE     rings, or arcs of several lists: the same points, else the same shape to SHAPE or its tolerance
    TRACE     a motion sampled in time: tolerance times the largest of the list; runs with encoder steps and the
              like by amplitude once they have parted
    PROSE     a sentence for people: may be worded anew, which is told
    IGNORED   not compared

    The scale of a number is the largest beside it: in its list, and under those keys of the object that holds it
    which carry the same unit.
    """

    EXACT = "exact"
    SMOOTH = "smooth"
    ITERATED = "iterated"
    CURVE = "curve"
    TRACE = "trace"
    PROSE = "prose"
    IGNORED = "ignored"


SMOOTHNESS = 1e-9
ROUNDING = 1e-12  # what rounding makes of a number that is a difference of others, of their size
SHAPE = 1e-6  # of a curve's extent: how far a curve may lie from itself, sampled at other points and interpolated
QUANTISED = 0.1  # of amplitudes, energies and frequencies of runs that have parted
FIRST_SAMPLES = 4  # samples that are the same before two runs part: the readings of before the first force


@dataclass(frozen=True)
class Rule:
    """command and key are patterns as of a shell; indices of lists are left out of keys: "bounds.name"."""

    command: str
    key: str
    kind: Kind
    why: str
    tolerance: float = SMOOTHNESS


TRACES = (
    "time_s",
    "position_m",
    "penetration_m",
    "velocity_m_per_s",
    "force_N",
    "handle_m",
    "energy_J",
    "counted_position_m",
    "depth_m",
    "torque_Nm",
    "joint_rad.*",
    "motor_rad.*",
    "kinetic_J",
    "elastic_J",
    "gravitational_J",
    "hand_work_J",
    "motor_work_J",
    "friction_loss_J",
)
SENTENCES = (
    "assumptions",
    "claim",
    "description",
    "ended_because",
    "explanation",
    "groups.reason",
    "label",
    "lacking",
    "meaning",
    "measurement*",
    "notes",
    "predicted_by",
    "reason",
    "source",
    "sources",
    "statement",
    "summary",
    "title",
    "unobserved_modes",
    "violated",
    "warning",
)
# The first that fits counts; what none fits is smooth if it is a number, else exact.
RULES: tuple[Rule, ...] = (
    Rule("*", "file", Kind.IGNORED, "a path on this machine"),
    Rule("*", "plane_file", Kind.IGNORED, "a path on this machine"),
    Rule("compile", "seconds", Kind.IGNORED, "a time"),
    *(
        Rule("*", pattern, Kind.PROSE, "a sentence for people")
        for name in SENTENCES
        for pattern in (name, f"*.{name}", f"{name}.*")
    ),
    *(
        Rule(command, key, Kind.TRACE, "rounding of a motion is relative to its largest excursion")
        for command in ("simulate", "move")
        for key in TRACES
    ),
    *(
        Rule(command, f"{name}.*", Kind.ITERATED, why, tolerance)
        for command, name, tolerance, why in (
            ("*", "fastest_decay", 1e-5, "a search; at a triple root its wall is known to 1e-5 (chart/decay.py)"),
            ("experiment", "points", 2e-4, "edges are bisected to 1e-4 of the stable range, tips to 1e-5"),
            ("limit-cycles", "limit_cycles.simulated", 1e-2, "read off a run near the cycle"),
            ("limit-cycles", "otherwise", 1e-2, "read off a run"),
            ("limit-cycles", "limit_cycles", 1e-7, "harmonics are balanced to 1e-8 (contact/harmonic_balance.py)"),
            (
                "guarantees",
                "coupling",
                1e-6,
                "golden section, levels within 1e-7 are equal (guarantees/coupling.py)",
            ),
        )
    ),
    *(
        Rule(command, key, Kind.ITERATED, why, tolerance)
        for command, key, tolerance, why in (
            ("experiment", "stiffness_max_N_per_m", 2e-5, "tips are bisected to 1e-5"),
            ("experiment", "damping_at_stiffness_max_Ns_per_m", 2e-4, "edges are bisected to 1e-4 of the range"),
            (
                "guarantees",
                "guarantees.stiffness_max_N_per_m",
                1e-5,
                "the edge with every spring is known to 1e-5",
            ),
            ("guarantees", "guarantees.damping_at_*", 1e-5, "the edge with every spring is known to 1e-5"),
            (
                "*",
                "*.d_ln_*",
                1e-8,
                "extrapolated differences, to about 1e-9 (study/sensitivity)",
            ),
            (
                "*",
                "*.d_stiffness_*",
                1e-8,
                "extrapolated differences, to about 1e-9 (study/sensitivity)",
            ),
            (
                "*",
                "*.one_percent_gives_*",
                1e-8,
                "extrapolated differences, to about 1e-9 (study/sensitivity)",
            ),
        )
    ),
    Rule("sensitivity", "*.error", Kind.IGNORED, "an estimate of rounding is rounding itself"),
    Rule("guarantees", "*regions", Kind.CURVE, "the edge with every spring is known to 1e-5", 1e-5),
    Rule("*", "*regions", Kind.CURVE, "sampled where the curve needs it"),
    Rule("*", "boundary", Kind.CURVE, "sampled where the curve needs it"),
)


def rule_of(command: str, key: str) -> Rule | None:
    """The first rule that fits."""
    for rule in RULES:
        if fnmatchcase(command, rule.command) and fnmatchcase(key, rule.key):
            return rule
    return None
