"""What the thesis shows by simulation, Figs. 3.10 and 5.12 to 5.14, and of the encoder's limit, 3.2.5."""

from __future__ import annotations

from math import inf, log

from docs._row import Claim, Misprint, Row
from gallery import fig_3_10_points as regions
from gallery import fig_3_12_one_sided as touched
from gallery import fig_5_12_before_and_after as optimised
from gallery import quantisation_limit as encoder
from gallery.fig_3_7_bilateral_wall import chart as bilateral


def figure_3_10() -> list[Row]:
    """3.2.3: what the two masses do in five regions; where, is ours."""
    A, B, C, D, E = (regions.points[name] for name in "ABCDE")
    at = "walls ours, the scan has none"
    slow = max(abs(C.judged.frequency - D.judged.frequency) / C.judged.frequency, abs(C.share - D.share))
    apart = regions.rigid_frequency / C.judged.frequency - 1.0
    return [
        Claim(
            "Fig. 3.10",
            f"from B to A ({at})",
            "the smaller mass oscillates relative to the larger one with an increasing amplitude",
            f"ln ρ = {log(B.radius):+.4f} at B, {log(A.radius):+.4f} at A; simulated {B.judged.growth:+.4f}, "
            f"{A.judged.growth:+.4f}; the link side has {100 * B.share:.0f} and {100 * A.share:.0f} % of the "
            f"motor side's amplitude at {A.judged.frequency:.0f} Hz",
            A.judged.behaviour == "growing" and B.judged.behaviour == "decaying" and max(A.share, B.share) < 0.1,
        ),
        Claim(
            "Fig. 3.10",
            f"at C and D ({at})",
            "both masses oscillate at the same frequency",
            f"{C.judged.frequency:.1f} and {D.judged.frequency:.1f} Hz, link side with {C.share:.2f} times the "
            "motor side's amplitude at both",
            slow < 0.01 and C.judged.behaviour == "decaying" and D.judged.behaviour == "growing",
        ),
        Claim(
            "Fig. 3.10",
            "at C and D, which model",
            "the behaviour can be described by a rigid-body model",
            f"one rigid mass vibrates at {regions.rigid_frequency:.1f} Hz there, {100 * apart:.0f} % faster",
            abs(apart) < 0.05,
            Misprint(
                f"the drives' spring is in series with the wall's and lowers the frequency by {100 * apart:.0f} %",
                0.05 < apart < 0.2,
                "an approximation",
            ),
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
            f"{touched.passive.min():.2f} to {touched.passive.max():.2f} Ns/m from {touched.STIFFNESS[0]:.0f} to "
            f"{touched.STIFFNESS[-1]:.0f} N/m, within {apart:.2f} Ns/m of the two-sided chart's edge",
            bool((touched.passive < 0.0).all()) and apart < 0.1,
        ),
        Claim(
            "3.3.1",
            "high negative virtual damping",
            "the operator's passive damping cannot explain it; he must compensate actively",
            f"the passive hand keeps contact down to {touched.passive.min():.1f} Ns/m and no further; a reflex "
            f"that stiffens it (amounts ours) lowers the edge by {gain.min():.1f} to {gain.max():.1f} Ns/m",
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
                f"to a tenth in {1e3 * after.to_a_tenth:.0f} ms instead of {1e3 * before.to_a_tenth:.0f} ms",
                0.0 < after.to_a_tenth < 0.6 * before.to_a_tenth,
            )
        )
    before, after = optimised.before["D"], optimised.after["D"]
    decays = min(("B", "C", "D"), key=lambda name: optimised.after[name].to_a_tenth)
    return [
        *rows,
        Claim(
            "Fig. 5.14",
            f"wall D, with {before.mass:.4f} and {after.mass:.4f} kg",
            "unstable before, stable after, and decays much faster than at B and C",
            f"ρ = {before.radius:.4f} before, {after.radius:.4f} after; to a tenth in "
            f"{1e3 * after.to_a_tenth:.0f} ms, fastest of the three: {decays}",
            before.judged.behaviour == "growing" and after.judged.behaviour == "decaying" and decays == "D",
        ),
    ]


def section_3_2_5() -> list[Row]:
    """3.2.5: what the encoder's limit is a limit of; friction, step and disturbance are ours."""
    at, limit = "3.2.5, 2 C/Δ", encoder.limit
    below = encoder.stiffness < limit
    quiet = not any(found[below].any() for found in encoder.moves.values())
    pushed = [edges for name, edges in encoder.onsets.items() if name.startswith("pushed between")]
    sharp = all(low < limit < high for low, high in pushed)
    free = {name: edges for name, edges in encoder.onsets.items() if not _disturbed(name)}
    lowest, highest = (pick(high for _, high in free.values()) for pick in (min, max))
    steep = [encoder.onsets[f"0.1 ms, {b} N s/m"][1] / limit for b in (3, 10, 30)]
    fast = [encoder.onsets[f"{T} ms, 10 N s/m"][1] / limit for T in ("0.2", "0.1", "0.05")]
    hand = encoder.AS_PRINTED
    met = encoder.around[hand] == [False, True]
    low, high = encoder.onsets["pushed by 2.75 C"]
    start = [encoder.onsets[f"from {x}"][1] for x in ("1 count", "50 counts, 1 mm")]
    speed = {encoder.onsets[f"hit at {v} m/s, 2.75 C"] for v in ("0.05", "0.2")}
    return [
        Claim(
            at,
            "no limit cycle below it (C, Δ and disturbances ours)",
            "26 700 N/m is the quantization limit",
            f"sufficient: of {len(encoder.moves)} cases of damping, sampling and disturbance none moves below it",
            quiet,
        ),
        Claim(
            at,
            "is it where limit cycles begin?",
            "26 700 N/m is the quantization limit",
            f"only where a push leaves the device between two counts: beyond {pushed[0][0] / 1e3:.1f}, at "
            f"{pushed[0][1] / 1e3:.1f} kN/m, with 3, 10 and 30 N s/m. Without a push from {lowest / limit:.0f} to "
            f"{highest / limit:.0f} times it",
            sharp and lowest < 1.5 * limit,
            Misprint(
                "the limit says where there is rest under every push, and no more",
                sharp and lowest > 2.0 * limit,
                "sufficient, no onset",
            ),
        ),
        Claim(
            at,
            "onset without a push, over damping and sampling",
            "–",
            f"with 3, 10, 30 N s/m at 0.1 ms on walls of {_listed(steep)} times the limit; at 0.2, 0.1, 0.05 ms "
            f"with 10 N s/m {_listed(fast)} times: that of the linear loop, or √2 beyond",
            all(
                1.0 <= edges[1] / encoder.linear_edge(encoder.CASES[name])[1] < 1.5 for name, edges in free.items()
            ),
        ),
        Claim(
            at,
            "onset over the disturbance",
            "–",
            f"never from 0.3 counts or pushed by 0.9 C; {start[0] / limit:.0f} times the limit from one count, "
            f"{start[1] / limit:.0f} from fifty; pushed by 2.75 C, from {low / 1e3:.0f} to {high / 1e3:.0f} kN/m, "
            "whether it starts there, 1 mm away, or hits a one-sided wall at 0.05 or 0.2 m/s",
            speed == {(low, high)} == {encoder.onsets["pushed by 2.75 C, from 1 mm"]}
            and encoder.onsets["from 0.3 counts"][1] == encoder.onsets["pushed by 0.9 C"][1] == inf
            and start[0] > start[1],
        ),
        Claim(
            "3.2.5, at 10 kHz",
            "limit cycles from 50 kN/m on",
            f"{encoder.PRINTED_ONSET / 1e3:.0f} kN/m, {encoder.PRINTED_ONSET / limit:.2f} times 2 C/Δ",
            f"not to be compared: C, Δ, damping and disturbance are not printed. A constant push of {hand:.2f} C, "
            "whatever C and Δ are, has its onset there: at rest 5 % below, moving 5 % above",
            met and encoder.first_without_rest(hand) > limit,
        ),
        Claim(
            "3.2.5, at 800 Hz",
            "the two masses lose stability well before",
            "the system is expected to lose stability well before quantization effects could be observed",
            f"{bilateral.stiffness_max / 1e3:.2f} kN/m, {bilateral.stiffness_max / limit:.2f} of the limit",
            bilateral.stiffness_max < 0.5 * limit,
        ),
    ]


def _disturbed(name: str) -> bool:
    """Is a case of the encoder's limit about the disturbance?"""
    return name.startswith(("from", "pushed", "hit"))


def _listed(values: list[float]) -> str:
    return ", ".join(f"{value:.1f}" for value in values)


def rows() -> list[Row]:
    """All of it."""
    return [*figure_3_10(), *section_3_2_5(), *figure_3_12(), *figures_5_12_to_5_14()]
