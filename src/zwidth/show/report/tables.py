"""The report's tables: rows of text for people, and the same numbers under names for programs."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan
from typing import Any

from zwidth.conditions import Bound
from zwidth.show.output import json_value
from zwidth.show.report import sentences
from zwidth.show.report.facts import Facts
from zwidth.show.units import NONE, SPACE, UNKNOWN, keys_of_moments, number, quantity
from zwidth.study.sensitivity.what_if import Variant

Row = tuple[str, ...]


def parameters(facts: Facts) -> list[Row]:
    """Name, symbol and value of each effective parameter that this device has."""
    effective = facts.effective
    flexible = sentences.frequency_list(facts)
    zero = f"0{SPACE}Hz"
    rigid = int((facts.natural_frequencies == 0.0).sum())
    modes = ", ".join([*([zero if rigid == 1 else f"{zero} ({rigid} rigid motions)"] if rigid else []), *flexible])
    rows = [
        ("link-side mass", "m₁", quantity(float(effective.link_side_mass), "kg")),
        ("motor-side mass", "m₂", quantity(float(effective.motor_side_mass), "kg")),
        ("mass with rigid drives", "m", quantity(float(effective.rigid_mass), "kg")),
        ("stiffness between the two sides", "k", quantity(float(effective.stiffness), "N/m")),
        ("natural frequencies", "f", modes or UNKNOWN),
    ]
    return [row for row in rows if row[-1] != UNKNOWN]


def limits(facts: Facts, variants: tuple[Variant, ...]) -> list[Row]:
    """Label, largest stiffness, its ratio to that as described, damping, frequency and area of each variant.

    A change that can be approached but not built is marked "ideal".
    """
    base = facts.base.stiffness_max
    return [
        (
            f"{variant.label} (ideal)" if variant.key in sentences.IDEAL else variant.label,
            quantity(variant.stiffness_max, "N/m") if variant.stiffness_max > 0.0 else NONE,
            f"{number(variant.stiffness_max / base)}{SPACE}×" if base > 0.0 else UNKNOWN,
            quantity(variant.damping, "N s/m"),
            ", ".join(sentences.hertz(f) for f in variant.frequencies) or UNKNOWN,
            quantity(variant.area, "N^2 s/m^2"),
        )
        for variant in variants
        if variant.chart is not None
    ]


def uncharted_variants(variants: tuple[Variant, ...]) -> list[Row]:
    """Labels and reason of the variants without a chart, those of one reason together."""
    reasons: dict[str, list[str]] = {}
    for variant in variants:
        if variant.chart is None:
            # what follows a semicolon is advice on asking for this model
            reasons.setdefault(variant.reason.split("; ")[0], []).append(variant.label)
    return [(sentences.join_words(labels), reason) for reason, labels in reasons.items()]


def single_changes(facts: Facts) -> tuple[Variant, ...]:
    """The device as described and its single changes."""
    return tuple(variant for variant in facts.variants if not variant.key.startswith("model-"))


def simpler_models(facts: Facts) -> tuple[Variant, ...]:
    """The device as described, then the variants by other models than its own."""
    own = {f"model-{facts.model}"}
    return (
        facts.base,
        *(variant for variant in facts.variants if variant.key.startswith("model-") and variant.key not in own),
    )


def bounds(facts: Facts, *, holding: bool) -> list[dict[str, Any]]:
    """Rows on the published conditions, and one on this report's answer before them; [] for no condition.

    holding  True: the conditions that apply; False: those that do not
    Returns  texts by `name`, `source`, `kind`, `stiffness`, `ratio` to this report's, and sentences on what is
             `unmet`
    """
    exact = facts.base.stiffness_max
    chosen = [bound for bound in facts.bounds if bound.holds == holding]
    report = {
        "name": "this report",
        "source": "",
        "kind": "stability, exact",
        "stiffness": _wall_text(exact, facts.base.damping),
        "ratio": f"1{SPACE}×" if facts.renders else UNKNOWN,
        "unmet": (),
    }
    rows = [
        {
            "name": bound.name,
            "source": bound.source,
            "kind": f"{bound.kind}, {bound.claim}",
            "stiffness": _wall_text(bound.stiffness_max, bound.damping_at_stiffness_max),
            "ratio": f"{number(bound.stiffness_max / exact)}{SPACE}×"
            if exact > 0.0 and bound.stiffness_max > 0.0
            else UNKNOWN,
            "unmet": (*bound.violated, *_lacking_sentences(bound)),
        }
        for bound in chosen
    ]
    return [report, *rows] if rows else []


def _lacking_sentences(bound: Bound) -> list[str]:
    """A sentence on the numbers that a condition takes and the device does not have; [] where it has all."""
    return [f"It needs {sentences.join_words(bound.lacking)}."] if bound.lacking else []


def _wall_text(stiffness: float, damping: float) -> str:
    """A largest stiffness [N/m] and its damping [N s/m] in words: "none" for 0, without a damping that is nan."""
    if stiffness == 0.0:
        return NONE
    wall = quantity(stiffness, "N/m")
    return wall if isnan(damping) else f"{wall} at {quantity(damping, 'N s/m')}"


def document(facts: Facts) -> dict[str, Any]:
    """All numbers of the report by the keys of the command line's --json; None for what is not known. Call it
    while the units of what is rendered are spoken."""
    chart, effective = facts.chart, facts.effective
    fastest, buildable = chart.fastest_decay, chart.fastest_decay_in_first_quadrant
    about = {
        "device": facts.device.name,
        "summary": sentences.summary(facts),
        "position_m": None if facts.posture is None else facts.posture.position.tolist(),
        "direction": None if facts.direction is None else facts.direction.tolist(),
        "assembly": None if facts.posture is None else facts.posture.assembly,
        "model": facts.model,
    }
    values = {
        "link_side_mass_kg": float(effective.link_side_mass),
        "motor_side_mass_kg": float(effective.motor_side_mass),
        "rigid_mass_kg": float(effective.rigid_mass),
        "stiffness_N_per_m": float(effective.stiffness),
        "natural_frequencies_Hz": facts.natural_frequencies.tolist(),
        **_chart_values(facts.base),
        "damping_max_Ns_per_m": chart.damping_max,
        "fastest_decay": fastest and fastest.document(),
        "fastest_decay_in_first_quadrant": buildable and buildable.document(),
        "unobserved_modes": list(chart.unobserved_modes),
        "static_stiffness_at_stiffness_max_N_per_m": facts.felt and facts.felt.stiffness_max,
        "static_stiffness_limit_N_per_m": facts.felt and facts.felt.limit,
        "static_stiffness_limit_kind": facts.felt and facts.felt.limit_kind,
        "sensitivities": _sensitivity_values(facts),
        "models": facts.validity and facts.validity.document(),
        **_load_values(facts),
        "bending": facts.bending and facts.bending.document(),
        "what_if": [
            {"key": variant.key, "label": variant.label, **_chart_values(variant)} for variant in facts.variants
        ],
        "bounds": _bound_values(facts),
    }
    reason = {} if facts.renders else {"reason": sentences.NO_WALL}
    numbers = keys_of_moments(values) if facts.point.turns else values
    return {key: _nan_to_none(value) for key, value in {**about, **numbers, **reason}.items()}


def _sensitivity_values(facts: Facts) -> list[dict[str, Any]]:
    """Return by key the sensitivity to each number of the device, with the reason where there is none."""
    return [
        {
            "path": number.path,
            "value": number.value,
            "d_ln_stiffness_max_d_ln_value": number.logarithmic,
            **({"reason": number.reason} if number.reason else {}),
        }
        for number in facts.sensitivities.numbers
    ]


def _bound_values(facts: Facts) -> list[dict[str, Any]]:
    """Return by key and unit the published conditions, what they assume, and what of that the device violates."""
    return [
        {
            "name": bound.name,
            "source": bound.source,
            "kind": bound.kind,
            "claim": bound.claim,
            "stiffness_max_N_per_m": bound.stiffness_max,
            "assumptions": list(bound.assumptions),
            "violated": list(bound.violated),
        }
        for bound in facts.bounds
    ]


def _load_values(facts: Facts) -> dict[str, Any]:
    """The equilibrium, the motions along the surface and the charts under other pushes; {} without load."""
    path, found = facts.load_path, facts.point
    if path is None:
        return {}
    return {
        "equilibrium": found.equilibrium.document(found.drives.names),
        "sideways_motions": [motion.document() for motion in facts.loop.sideways_motions],
        "load_path": json_value(path.document()),
    }


def _chart_values(variant: Variant) -> dict[str, Any]:
    """Numbers of the chart of a variant by key and unit, with the reason where it has none."""
    frequencies = list(variant.frequencies)
    return {
        "stiffness_max_N_per_m": variant.stiffness_max or None,
        "damping_at_stiffness_max_Ns_per_m": variant.damping,
        "frequency_at_stiffness_max_Hz": min(frequencies, default=None),
        "frequencies_at_stiffness_max_Hz": frequencies,
        "stable_area_N2s_per_m2": variant.area,
        **({"reason": variant.reason} if variant.reason else {}),
    }


def _nan_to_none(value: Any) -> Any:
    """The value with None for each nan in it; an infinite stiffness stays infinite."""
    if isinstance(value, Mapping):
        return {key: _nan_to_none(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_nan_to_none(inner) for inner in value]
    return None if isinstance(value, float) and value != value else value
