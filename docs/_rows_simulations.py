"""What the thesis shows by simulation: Figs. 3.10, 3.12, 5.12 to 5.14; 3.2.5 is in `docs._rows_quantisation`."""

from __future__ import annotations

from math import log

from docs._comparison_row import Claim, Row
from docs._rows_quantisation import section_3_2_5
from gallery import fig_3_10_chart_regions as regions
from gallery import fig_3_12_one_sided as touched
from gallery import fig_5_12_before_and_after as optimised


def figure_3_10() -> list[Row]:
    """3.2.3: what the two masses do in five regions; where, is ours."""
    A, B, C, D, E = (regions.points[name] for name in "ABCDE")
    at = "walls ours, the scan has none"
    slow = max(
        abs(C.judgement.frequency - D.judgement.frequency) / C.judgement.frequency,
        abs(C.amplitude_ratio - D.amplitude_ratio),
    )
    apart, rigid = regions.rigid_frequency / C.judgement.frequency - 1.0, regions.rigid_radius
    return [
        Claim(
            "Fig. 3.10, (2.37)–(2.41)",
            f"from B to A ({at})",
            "the smaller mass oscillates relative to the larger one with an increasing amplitude",
            f"ln ρ = {log(B.radius):+.4f} at B, {log(A.radius):+.4f} at A; simulated {B.judgement.growth:+.4f}, "
            f"{A.judgement.growth:+.4f}; "
            f"the link side has {100 * B.amplitude_ratio:.0f} and {100 * A.amplitude_ratio:.0f} % of the "
            f"motor side's amplitude at {A.judgement.frequency:.0f} Hz",
            A.judgement.behaviour == "growing"
            and B.judgement.behaviour == "decaying"
            and max(A.amplitude_ratio, B.amplitude_ratio) < 0.1,
        ),
        Claim(
            "Fig. 3.10",
            f"at C and D ({at})",
            "both masses oscillate at the same frequency",
            f"{C.judgement.frequency:.1f} and {D.judgement.frequency:.1f} Hz, "
            f"link side with {C.amplitude_ratio:.2f} times the "
            "motor side's amplitude at both",
            slow < 0.01 and C.judgement.behaviour == "decaying" and D.judgement.behaviour == "growing",
        ),
        Claim(
            "Fig. 3.10",
            "at C and D, which model",
            "the behaviour can be described by a rigid-body model",
            f"one rigid mass is stable at C (ρ = {rigid['C']:.4f}) and unstable at D ({rigid['D']:.4f}) as "
            f"well; it vibrates at {regions.rigid_frequency:.1f} Hz, {100 * apart:.0f} % faster, for the "
            "drives' spring is in series with the wall's",
            all((radius < 1.0) == (regions.points[name].radius < 1.0) for name, radius in rigid.items())
            and abs(apart) < 0.2,
        ),
        Claim(
            "Fig. 3.10",
            "point E",
            "the fastest decaying oscillation",
            f"ρ = {E.radius:.4f}; of the other four the least is {min(p.radius for p in (A, B, C, D)):.4f}",
            E.radius < min(point.radius for point in (A, B, C, D)),
        ),
    ]


def figure_3_12() -> list[Row]:
    """3.3: one-sided walls under a hand's push; its points are not in the scan."""
    apart = float(abs(touched.passive - touched.two_sided).max())
    gain = touched.passive - touched.reflex
    return [
        Claim(
            "Fig. 3.12",
            f"one-sided wall, pushed with {touched.PUSH:.0f} N by the passive hand: lower edge",
            "in the negative virtual damping domain",
            f"{touched.passive.min():.2f} to {touched.passive.max():.2f} N s/m from {touched.STIFFNESS[0]:.0f} to "
            f"{touched.STIFFNESS[-1]:.0f} N/m, within {apart:.2f} N s/m of the two-sided chart's edge",
            bool((touched.passive < 0.0).all()) and apart < 0.1,
        ),
        Claim(
            "3.3.1",
            "high negative virtual damping",
            "the operator's passive damping cannot explain it; he must compensate actively",
            f"the passive hand keeps contact down to {touched.passive.min():.1f} N s/m and no further; a reflex "
            f"that stiffens it (amounts ours) lowers the edge by {gain.min():.1f} to {gain.max():.1f} N s/m",
            bool((gain > 0.2).all()),
        ),
    ]


def figures_5_12_to_5_14() -> list[Row]:
    """5.3.2: x1 - x2 before and after the motor's mass is optimised; the start is ours."""
    rows: list[Row] = []
    for figure, name in (("5.12", "B"), ("5.13", "C")):
        before, after = optimised.before[name], optimised.after[name]
        rows.append(
            Claim(
                f"Fig. {figure}",
                f"wall {name}, with {before.mass:.4f} and {after.mass:.4f} kg",
                "vibrations due to structural flexibility decay much faster",
                f"to a tenth in {1e3 * after.decay_time_to_tenth:.0f} ms "
                f"instead of {1e3 * before.decay_time_to_tenth:.0f} ms",
                0.0 < after.decay_time_to_tenth < 0.6 * before.decay_time_to_tenth,
            )
        )
    before, after = optimised.before["D"], optimised.after["D"]
    decays = min(("B", "C", "D"), key=lambda name: optimised.after[name].decay_time_to_tenth)
    return [
        *rows,
        Claim(
            "Fig. 5.14",
            f"wall D, with {before.mass:.4f} and {after.mass:.4f} kg",
            "unstable before, stable after, and decays much faster than at B and C",
            f"ρ = {before.radius:.4f} before, {after.radius:.4f} after; to a tenth in "
            f"{1e3 * after.decay_time_to_tenth:.0f} ms, fastest of the three: {decays}",
            before.judged.behaviour == "growing" and after.judged.behaviour == "decaying" and decays == "D",
        ),
    ]


def rows() -> list[Row]:
    """All of it."""
    return [*figure_3_10(), *section_3_2_5(), *figure_3_12(), *figures_5_12_to_5_14()]
