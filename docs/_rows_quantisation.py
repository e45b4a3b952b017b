"""3.2.5: what the encoder's limit is a limit of."""

from __future__ import annotations

from math import inf

from docs._comparison_row import ANOTHER_QUESTION, Claim, Reason, Row
from gallery import quantisation_limit as encoder
from gallery.fig_3_7_bilateral_wall import chart as bilateral


def section_3_2_5() -> list[Row]:
    """3.2.5: what the encoder's limit is a limit of; friction, step and disturbance are ours."""
    at, limit = "3.2.5, 2 C/Δ", encoder.limit
    below = encoder.stiffness < limit
    quiet = not any(found[below].any() for found in encoder.moves.values())
    pushed = [edges for name, edges in encoder.onsets.items() if name.startswith("pushed between")]
    sharp = all(low < limit < high for low, high in pushed)
    free = {name: edges for name, edges in encoder.onsets.items() if not _has_disturbance(name)}
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
            Reason(
                ANOTHER_QUESTION,
                "the limit answers where there is rest under every push, and no more",
                sharp and lowest > 2.0 * limit,
            ),
        ),
        Claim(
            at,
            "onset without a push, over damping and sampling",
            None,
            f"with 3, 10, 30 N s/m at 0.1 ms on walls of {_listed(steep)} times the limit; at 0.2, 0.1, 0.05 ms "
            f"with 10 N s/m {_listed(fast)} times: that of the linear loop, or √2 beyond",
            all(
                1.0 <= edges[1] / encoder.linear_edge(encoder.CASES[name])[1] < 1.5 for name, edges in free.items()
            ),
            route="eigenvalues of the linear loop",
        ),
        Claim(
            at,
            "onset over the disturbance",
            None,
            f"never from 0.3 counts or pushed by 0.9 C; {start[0] / limit:.0f} times the limit from one count, "
            f"{start[1] / limit:.0f} from fifty; pushed by 2.75 C, from {low / 1e3:.0f} to {high / 1e3:.0f} kN/m, "
            "whether it starts there, 1 mm away, or hits a one-sided wall at 0.05 or 0.2 m/s",
            speed == {(low, high)} == {encoder.onsets["pushed by 2.75 C, from 1 mm"]}
            and encoder.onsets["from 0.3 counts"][1] == encoder.onsets["pushed by 0.9 C"][1] == inf
            and start[0] > start[1]
            and low <= encoder.first_without_rest(hand) <= high,
            route="closed form of the push, (f + C)/(n Δ)",
        ),
        Claim(
            "3.2.5, at 10 kHz",
            "the printed onset of 50 kN/m",
            None,
            f"{encoder.PRINTED_ONSET / limit:.2f} times 2 C/Δ is the onset under a constant push of {hand:.2f} C, "
            "whatever C and Δ are: at rest 5 % below, moving 5 % above",
            met and abs(encoder.first_without_rest(hand) / encoder.PRINTED_ONSET - 1.0) < 1e-12,
            route="closed form of the push, (f + C)/(n Δ)",
        ),
        Claim(
            "3.2.5, at 800 Hz",
            "the two masses lose stability well before",
            "the system is expected to lose stability well before quantization effects could be observed",
            f"{bilateral.stiffness_max / 1e3:.2f} kN/m, {bilateral.stiffness_max / limit:.2f} of the limit",
            bilateral.stiffness_max < 0.5 * limit,
        ),
    ]


def _has_disturbance(name: str) -> bool:
    """Is a case of the encoder's limit about the disturbance?"""
    return name.startswith(("from", "pushed", "hit"))


def _listed(values: list[float]) -> str:
    return ", ".join(f"{value:.1f}" for value in values)
