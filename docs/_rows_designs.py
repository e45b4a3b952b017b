"""Chapter 5 over designs: base distance, assemblies, link length, motor; Figs. 5.5 to 5.9."""

from __future__ import annotations

import numpy as np

from docs._comparison_row import ANOTHER_QUESTION, UNEXPLAINED, Claim, Number, Reason, Row
from gallery import best_designs as best
from gallery import fig_5_5_base_distance as base
from gallery import fig_5_6_assemblies as assemblies
from gallery import fig_5_8_link_length as link
from gallery import fig_5_9_motor as motor


def base_distance() -> list[Row]:
    """Fig. 5.5."""
    rigid, flexible = base.factors["rigid"], base.factors["flexible"]
    whole, other = base.factors_of_all["rigid"], base.factors_of_all
    within = f"over |x| ≤ {base.WITHIN} m"
    exact = base.factors["exact"]
    return [
        Claim(
            "5.3.1",
            "base distances at the reference position",
            "−2 m to 2 m",
            f"the handle gets there for d from {base.farthest_crossed:.3f} to {base.farthest_apart:.3f} m",
            base.reaches(1.0) and base.reaches(-1.0),
            Reason(
                UNEXPLAINED,
                f"with the lengths of Table 3.2 2 √(0.346² − 0.25²) m = {base.farthest_by_geometry:.4f} m is the "
                "farthest that the arms allow; ±0.2 m, the range of Fig. 5.5, would be within reach",
                abs(base.farthest_apart - base.farthest_by_geometry) < 1e-3
                and abs(base.farthest_crossed + base.farthest_by_geometry) < 1e-3,
            ),
        ),
        Claim(
            "Fig. 5.5a",
            "rigid: largest over least stiffness along x, d = −0.2 m",
            "three times",
            f"{base.ratio_of_stiffness:.2f} {within}, three over |x| ≤ {base.three_within['rigid']:.3f} m, "
            f"{whole[-0.2]:.2f} of all that is reached (|x| ≤ 0.139 m); of the links alone "
            f"{base.factors['links'][-0.2]:.2f} {within}; with d = +0.2 m {rigid[0.2]:.2f}, of all "
            f"{whole[0.2]:.2f}",
            round(base.ratio_of_stiffness) == 3,
        ),
        Claim(
            "Fig. 5.5b",
            "flexible: the same",
            "three times",
            f"(5.7) three over |x| ≤ {base.three_within['flexible']:.3f} m, the full model exactly over "
            f"{base.three_within['exact']:.3f} m; {within} {flexible[-0.2]:.0f} and {exact[-0.2]:.0f}. With "
            f"d = +0.2 m {other['flexible'][0.2]:.2f} and {other['exact'][0.2]:.2f} of all that is reached",
            round(flexible[-0.2]) == 3,
            Reason(
                ANOTHER_QUESTION,
                "the sentence names no model, no range of x, and the scan no sign of d. The rigid body has "
                "three; so has (5.7) with d = +0.2 m over all that is reached. With d = −0.2 m the distal links "
                "come into one line towards the edge of reach (sine of the angle between them "
                f"{base.between_at_the_edge:.3f} at 0.139 m), where the stiffness is zero: no factor without a "
                "range",
                flexible[-0.2] > 20.0
                and base.between_at_the_edge < 0.05
                and round(base.ratio_of_stiffness) == round(other["flexible"][0.2]) == 3,
            ),
        ),
        Claim(
            "Fig. 5.5",
            "symmetry",
            "rigid symmetric, flexible asymmetric, for the structure is",
            "rigid to rounding; (5.7) differs by up to "
            f"{100 * base.asymmetries['flexible']:.0f} % between x and −x, the full model by "
            f"{100 * base.asymmetries['exact']:.0f} %. With equally stiff drives both are symmetric, "
            "to rounding",
            base.asymmetries["rigid"] < 1e-9 < 0.1 < base.asymmetries["flexible"]
            and max(base.asymmetries_with_equal_drives[name] for name in ("flexible", "exact")) < 1e-9,
        ),
        Claim(
            "Fig. 5.5a",
            "rigid: most uniform",
            "d = 0",
            _varies("rigid"),
            min(rigid, key=lambda d: rigid[d]) == 0.0,
        ),
        Claim(
            "Fig. 5.5b",
            "flexible: most uniform",
            "d = 0",
            _varies("flexible") + f"; exactly {_varies('exact')}",
            min(flexible, key=lambda d: flexible[d]) == 0.0,
            Reason(
                ANOTHER_QUESTION,
                f"right of the full model {within}, {exact[0.0]:.2f} against {exact[0.1]:.2f} at 0.1 m. By "
                f"(5.7) 0.1 m varies less, {flexible[0.1]:.2f} against {flexible[0.0]:.2f}",
                flexible[0.1] < 0.95 * flexible[0.0] and min(exact, key=lambda d: exact[d]) == 0.0,
            ),
        ),
    ]


def _varies(name: str) -> str:
    texts = (f"{value:.2f} at {d:g} m" for d, value in base.factors[name].items())
    return "largest over least " + ", ".join(texts).replace("-", "−")


def elbows() -> list[Row]:
    """Figs. 5.6 and 5.7."""
    ratio, mirrored = assemblies.between_assemblies, assemblies.mirrored
    right = assemblies.least["elbows-right"]
    at, least = assemblies.least["elbows-out"]["flexible"]
    return [
        Claim(
            "Figs. 5.6, 5.7",
            "elbow up against elbow down, the handle at one place",
            "can be influenced considerably",
            f"arms outward and inward differ by up to {ratio['flexible']:.1f} times in (5.7) and "
            f"{ratio['flexible_area']:.0f} in its area, {ratio['rigid']:.1f} and {ratio['rigid_area']:.0f} rigid "
            f"(|d| ≤ {assemblies.USUAL} m); at −d one is the other's mirror image, (5.7) to "
            f"rounding, the full model to {mirrored['exact']:.0e}, rigid to {mirrored['rigid']:.2f}",
            ratio["flexible"] > 2.0 and ratio["rigid"] > 2.0 and mirrored["flexible"] < 1e-9,
        ),
        Claim(
            "Figs. 5.6, 5.7",
            "both ends of the curves",
            None,
            f"stretched arms at |d| = {base.farthest_by_geometry:.3f} m: the stiffness grows without end, "
            f"{assemblies.growth_at_the_end:.0f} times over the last 5 cm. Between, arms outward have least at "
            f"d = {at:.3f} m: {least:.0f} N/m by (5.7)",
            assemblies.growth_at_the_end > 5.0
            and 0.2 < at < 0.4
            and abs(assemblies.by_hand("elbows-out", at) / least - 1.0) < 1e-6
            and min(assemblies.by_hand("elbows-out", at + step) for step in (-0.005, 0.005)) > least,
            route="arms by hand, there and 5 mm beside, to 1e-06",
        ),
        Claim(
            "Fig. 5.6",
            "both elbows on one side",
            None,
            f"singular at d = 0, where the arms coincide: (5.7) falls to {right['flexible'][1]:.1f} N/m, the full "
            f"model to {right['exact'][1]:.1f} N/m 5 mm beside it, the rigid body to "
            f"{right['rigid'][1] / 1e3:.1f} kN/m",
            max(right["flexible"][1], right["exact"][1]) < 10.0
            and abs(right["flexible"][0]) < 0.006
            and abs(assemblies.by_hand("elbows-right", right["flexible"][0]) / right["flexible"][1] - 1.0) < 1e-6,
            route="(5.7) of the arms by hand, to 1e-06",
        ),
    ]


def link_length() -> list[Row]:
    """Fig. 5.8."""
    facing = [key for key in link.curves if key[2] in ("elbows-out", "elbows-in")]
    parallel = [key for key in link.low_points if key not in facing]
    near = [
        at
        for key in facing
        for lows in link.low_points[key].values()
        for at in lows
        if abs(at - link.LENGTH) < 0.1
    ]
    flexible = [link.low_points[key][model] for key in parallel for model in ("flexible", "exact")]
    singular = all(
        len(lows) == 1 and link.curves[key].by_singularity(lows[0])
        for key in parallel
        for lows in (link.low_points[key]["flexible"], link.low_points[key]["exact"])
    )
    rigid = sorted({at for key in parallel for at in link.low_points[key]["rigid"]})
    far = sorted({at for key in facing for lows in link.low_points[key].values() for at in lows})
    here, longer = (link.value(link.ALONE, "flexible", at) for at in (link.LENGTH, 0.2))
    both = [link.value(link.TIED, "flexible", at) for at in (link.LENGTH, 0.2)]
    beyond = link.value(link.DOWN, "flexible", 0.2)
    return [
        Claim(
            "Fig. 5.8",
            "largest stiffness over L1, “elbow down”",
            "least at L1 = 0.146 m, “the current value” (Table 3.2: 0.147 m)",
            "arms outward or inward, L1 alone or with L3, mass and inertia kept, grown or as Appendix B: no low "
            f"point of any model within 0.1 m of it; the nearest is at {far[0]:.3f} m, with L1 = L3",
            bool(near),
            Reason(
                ANOTHER_QUESTION,
                "it is least there in another assembly, at a singularity: with both elbows on one side and L1 "
                f"alone, the arms coincide at L1 = L3 = {link.curves[link.DOWN].singular[0]:.3f} m, nothing "
                "holds the handle across them, and (5.7) is zero, as is the full model's stiffness; "
                f"{1e3 * length_step():.0f} mm beside it (5.7) has {100 * link.fall:.3f} % of its value at 0.1 "
                f"m. The rigid body's minima lie elsewhere there, from {rigid[0]:.3f} to {rigid[-1]:.3f} m",
                not near and singular and len(flexible) == 2 * len(parallel) and link.fall < 1e-2,
            ),
        ),
        Claim(
            "Fig. 5.8",
            "low points with L1 = L3",
            None,
            f"singular at {link.both_in_line:.4f} m, where the distal links lie in one "
            "line: (5.7) and the full model fall to zero. The rigid body has its minimum beside it, at "
            f"{_listed(link.low_points[link.TIED]['rigid'])} m outward",
            all(abs(at - link.both_in_line) < 1e-8 for key in facing for at in link.curves[key].singular),
            route="√(0.25² + 0.199²) m, to 1e-08 m",
        ),
        Claim(
            "Fig. 5.8",
            "for higher stiffness",
            "larger values of L1",
            f"arms outward, (5.7): {here:.0f} N/m as built, {longer:.0f} N/m at 0.2 m, {both[1]:.0f} N/m with "
            "both driven arms: shorter ones render more",
            longer > here,
            Reason(
                ANOTHER_QUESTION,
                "right beyond that singularity: with both elbows on one side (5.7) rises from zero to "
                f"{beyond:.0f} N/m at 0.2 m. Arms outward, a longer arm moves the handle farther per turn, so "
                "that less is felt of rotor and spring, by the square",
                longer < here and both[1] < both[0] and beyond > 100.0,
            ),
        ),
    ]


def length_step() -> float:
    """Of the grid of Fig. 5.8 [m]."""
    return float(link.length[1] - link.length[0])


def _listed(values: list[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)


def motors() -> list[Row]:
    """Fig. 5.9."""
    lows, highs = motor.flexible, motor.exact
    return [
        *(
            Number(
                "Fig. 5.9a",
                f"p_max at W = {W}",
                float(motor.sprung_range(1.0, W**2, 1.0).stiffness_max),
                second_value=motor.p_max_by_brute_force(W),
                tolerance=1e-9,
            )
            for W in (0.5, 1.0, 1.4)
        ),
        Claim(
            "Fig. 5.9a",
            "p_max over W",
            "changes considerably",
            f"falls throughout, from {motor.limit_rigid:.4f}, the free mass's, to 0 at π/2; none up to 3π/2. The "
            f"five-bar at (0, 0.25) m has W = {motor.W_of_the_device:.3f} and p_max = {motor.p_of_the_device:.3f}",
            motor.falls and bool(np.isnan(motor.beyond).all()) and abs(motor.limit_rigid - 0.686292) < 1e-6,
        ),
        Claim(
            "Fig. 5.9b",
            "largest stiffness over the motor's inertia I_m1",
            None,
            f"grows throughout: from {lows[0]:.0f} to {lows[-1]:.0f} N/m by (5.7), {highs[0]:.0f} to "
            f"{highs[-1]:.0f} N/m exactly, from a fifth of the inertia to five times; with twice the inertia, "
            f"{motor.doubled[0]:.2f} and {motor.doubled[1]:.2f} times the stiffness. (5.7) levels off at "
            f"{motor.levels_off:.0f} N/m, the other motor's alone",
            bool(np.all(np.diff(lows) > 0.0) and np.all(np.diff(highs) > 0.0))
            and lows[-1] < motor.levels_off
            and motor.error_by_hand < 1e-9,
            route="(5.7) of the arms by hand, to 1e-09",
        ),
    ]


def best_designs() -> list[Row]:
    """What an optimiser finds of the same questions."""
    wide = best.condition[0] > 10.0 * best.condition[-1] and best.stiffness[0] > 1.02 * best.stiffness[-1]
    return [
        Claim(
            "5.3.1",
            "dexterity and high stable virtual stiffness",
            "is in contrast",
            "over both links' lengths, a square of 6 cm to be reached: along the front that an optimiser finds "
            "what is stiffer is less isotropic throughout; the last 2 % of stiffness cost more than ten times "
            "the condition number",
            best.in_contrast and wide,
        ),
        Claim(
            "(5.14)-(5.15)",
            "the optimal mass, by search from the eigenvalues' radius alone",
            None,
            "that of (5.14), with the radius of (5.15), at the four walls, to 1e-06 in mass and 1e-09 in radius",
            best.mass_error < 1e-6 and best.radius_error < 1e-9,
            route="the closed forms",
        ),
    ]


def designs() -> list[Row]:
    """All of it."""
    return [*base_distance(), *elbows(), *link_length(), *motors(), *best_designs()]
