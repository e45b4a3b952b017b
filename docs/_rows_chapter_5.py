"""Chapter 5 over the workspace and over designs: Figs. 5.1 to 5.9."""

from __future__ import annotations

import numpy as np

from docs._row import Claim, Misprint, Number, Row
from docs._rows_eigenvalues import eigenvalues
from gallery import fig_5_1_workspace as maps
from gallery import fig_5_4_common_area as common
from gallery import fig_5_5_base_distance as base
from gallery import fig_5_6_assemblies as assemblies
from gallery import fig_5_8_link_length as link
from gallery import fig_5_9_motor as motor

AT = "at (0, 0.25) m"
BY_HAND = 1e-11  # closed forms against each other


def dexterity() -> list[Row]:
    """Fig. 5.1."""
    low, high = maps.kappa_where_dexterous
    share = maps.isotropic[1.5]
    titles = {
        "manipulability": ("manipulability", "m²"),
        "dynamic_manipulability": ("dynamic manipulability", "1/(kg m)²"),
        "isotropy": ("condition number", ""),
    }
    return [
        *(
            Number("Fig. 5.1", f"{title} {AT}", maps.here[name][0], unit, judge=maps.here[name][1], within=BY_HAND)
            for name, (title, unit) in titles.items()
        ),
        Claim(
            "Fig. 5.1",
            "kinematic isotropy",
            "almost constant and close to unity in most of the workspace, where the manipulabilities are maximum",
            f"the condition number is at most 1.5 in {100 * share:.0f} % of what is reached (y ≥ 0.05 m), at most "
            f"2 in {100 * maps.isotropic[2.0]:.0f} %; where both manipulabilities are within a tenth of their "
            f"largest it goes from {low:.2f} to {high:.2f}",
            share > 0.5,
        ),
        Claim(
            "Fig. 5.1",
            "dexterity",
            "low close to the workspace boundary",
            f"in the outermost centimetre the manipulability is at most {maps.rim['w']:.2f} of its largest, the "
            f"condition number at least {maps.rim['kappa']:.1f}",
            maps.rim["w"] < 0.6 and maps.rim["kappa"] > 4.0,
        ),
    ]


def impedance_range() -> list[Row]:
    """Figs. 5.2 and 5.3."""
    texts = {
        "rigid": ("Fig. 5.2", "rigid, links and rotors: largest stiffness"),
        "links": ("Fig. 5.2", "rigid, m_e1 of the links alone, as (5.4) prints it: largest stiffness"),
        "motor-mass": ("Fig. 5.3", "flexible, (5.7): largest stiffness"),
        "full": ("Figs. 5.2, 5.3", "full model, 5 % damping, exact: largest stiffness"),
    }
    contrast, alike = maps.contrast, maps.alike
    r, kappa = maps.at_largest("rigid")
    with_kappa = [contrast[model, "kappa"] for model in ("rigid", "flexible")]
    symmetric = max(maps.asymmetries[name] for name in ("rigid", "rigid area"))
    return [
        *(
            Number(place, f"{text} {AT}", maps.stiffest[model], "N/m", judge=maps.judged(model), within=1e-9)
            for model, (place, text) in texts.items()
        ),
        Claim(
            "Figs. 5.2, 5.3",
            "rigid against flexible over the workspace",
            "similar characteristics",
            f"rank correlation {alike['stiffness']:.2f} of the stiffnesses, {alike['area']:.2f} of the areas, "
            f"{alike['exact']:.2f} of rigid with exact; the rigid maps are symmetric to rounding, (5.7) "
            f"differs by up to {100 * maps.asymmetries['flexible']:.0f} % between x and −x",
            min(alike.values()) > 0.9 and symmetric < 1e-9,
        ),
        Claim(
            "Figs. 5.1-5.3",
            "largest stiffness against manipulability",
            "in contrast",
            f"rank correlation {contrast['rigid', 'w']:+.2f} rigid, {contrast['flexible', 'w']:+.2f} flexible; "
            f"with the dynamic one {contrast['rigid', 'w_d']:+.2f} and {contrast['flexible', 'w_d']:+.2f}",
            max(contrast[model, m] for model in ("rigid", "flexible") for m in ("w", "w_d")) < -0.4,
        ),
        Claim(
            "Figs. 5.1-5.3",
            "largest stiffness against condition number",
            "best where the condition number is low",
            f"rank correlation {with_kappa[0]:+.1f} rigid, {with_kappa[1]:+.1f} flexible; the stiffest place of "
            f"the map, {1e3 * r:.0f} mm from the base, has a condition number of {kappa:.1f}",
            kappa < 2.0,
            Misprint(
                "masses grow towards folded and stretched arms, and there the condition number does so too",
                kappa > 4.0 and maps.rim["kappa"] > 4.0 and min(with_kappa) > -0.5,
                "not so at its best",
            ),
        ),
    ]


def common_area() -> list[Row]:
    """Fig. 5.4."""
    names = {"link_side_mass": "m_e1 of the links", "rigid_mass": "links and rotors"}
    there = common.at_reference
    return [
        *(
            Number(
                "Fig. 5.4",
                f"common area, {name} ≥ 0.2 kg ({100 * common.areas[mass].common.share:.0f} % of what is reached)",
                1e4 * common.areas[mass].common.area,
                "cm²",
                judge=1e4 * common.by_integration[mass],
                within=1e-3,
                digits=3,
            )
            for mass, name in names.items()
        ),
        Claim(
            "Fig. 5.4",
            "the selected values",
            "correspond to locations close to the reference configuration",
            f"the reference has w = {there['manipulability']:.4f} m², m_e1 = {there['link_side_mass']:.4f} kg and "
            f"κ = {there['isotropy']:.3f}, more than 1.3: the common area begins "
            f"{1e3 * common.distance_from_reference:.1f} mm away",
            common.distance_from_reference < 0.02,
        ),
    ]


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
            Misprint(
                f"2 √(0.346² − 0.25²) m = {base.farthest_by_geometry:.4f} m is the farthest the arms allow",
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
            Misprint(
                "towards the edge of reach the distal links come into one line (sine of the angle between them "
                f"{base.between_at_the_edge:.3f} at 0.139 m), where nothing holds the handle and the stiffness is "
                "zero: no factor without a range",
                flexible[-0.2] > 20.0 and base.between_at_the_edge < 0.05,
                "depends on the range",
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
            Misprint(
                f"by (5.7) d = 0.1 m varies less, {flexible[0.1]:.2f} against {flexible[0.0]:.2f}; exactly it "
                f"does not, {exact[0.1]:.2f} against {exact[0.0]:.2f}",
                flexible[0.1] < 0.95 * flexible[0.0] and exact[0.1] > exact[0.0],
                "depends on the model",
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
            "–",
            f"stretched arms at |d| = {base.farthest_by_geometry:.3f} m: the stiffness grows without end, "
            f"{assemblies.growth_at_the_end:.0f} times over the last 5 cm. Between, arms outward have least at "
            f"d = {at:.3f} m: {least:.0f} N/m by (5.7)",
            assemblies.growth_at_the_end > 5.0 and 0.2 < at < 0.4,
        ),
        Claim(
            "Fig. 5.6",
            "both elbows on one side",
            "–",
            f"singular at d = 0, where the arms coincide: (5.7) falls to {right['flexible'][1]:.1f} N/m, the full "
            f"model to {right['exact'][1]:.1f} N/m 5 mm beside it, the rigid body to "
            f"{right['rigid'][1] / 1e3:.1f} kN/m",
            max(right["flexible"][1], right["exact"][1]) < 10.0 and abs(right["flexible"][0]) < 0.006,
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
    return [
        Claim(
            "Fig. 5.8",
            "largest stiffness over L1, “elbow down”",
            "least at L1 = 0.146 m, “the current value” (Table 3.2: 0.147 m)",
            "arms outward or inward, L1 alone or with L3, mass and inertia kept, grown or as Appendix B: no low "
            f"point of any model within 0.1 m of it; the nearest is at {far[0]:.3f} m, with L1 = L3",
            bool(near),
            Misprint(
                "it is a singularity of another assembly: with both elbows on one side and L1 alone, the arms "
                f"coincide at L1 = L3 = {link.curves[link.DOWN].singular[0]:.3f} m, nothing holds the handle "
                "across them, and (5.7) is zero, as is the full model's stiffness; "
                f"{1e3 * length_step():.0f} mm beside it (5.7) has {100 * link.fall:.3f} % of its value at 0.1 m. "
                f"The rigid body's minima lie elsewhere there, from {rigid[0]:.3f} to {rigid[-1]:.3f} m",
                not near and singular and len(flexible) == 2 * len(parallel) and link.fall < 1e-2,
                "no minimum",
            ),
        ),
        Claim(
            "Fig. 5.8",
            "low points with L1 = L3",
            "–",
            f"singular at √(0.25² + 0.199²) m = {link.both_in_line:.4f} m, where the distal links lie in one "
            "line: (5.7) and the full model fall to zero. The rigid body has its minimum beside it, at "
            f"{_listed(link.low_points[link.TIED]['rigid'])} m outward",
            all(abs(at - link.both_in_line) < 1e-8 for key in facing for at in link.curves[key].singular),
        ),
        Claim(
            "Fig. 5.8",
            "for higher stiffness",
            "larger values of L1",
            f"arms outward, (5.7): {here:.0f} N/m as built, {longer:.0f} N/m at 0.2 m, {both[1]:.0f} N/m with "
            "both driven arms: shorter ones render more",
            longer > here,
            Misprint(
                "a longer arm moves the handle farther per turn, so that less is felt of rotor and spring, by the "
                "square",
                longer < here and both[1] < both[0],
                "only beyond the singularity",
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
                judge=motor.judged(W),
                within=1e-9,
            )
            for W in (0.5, 1.0, 1.4)
        ),
        Claim(
            "Fig. 5.9a",
            "p_max over W",
            "changes considerably",
            f"falls throughout, from {motor.limit_rigid:.4f}, the free mass's, to 0 at π/2; none up to 3π/2. The "
            f"five-bar {AT} has W = {motor.W_of_the_device:.3f} and p_max = {motor.p_of_the_device:.3f}",
            motor.falls and bool(np.isnan(motor.beyond).all()) and abs(motor.limit_rigid - 0.686292) < 1e-6,
        ),
        Claim(
            "Fig. 5.9b",
            "largest stiffness over the motor's inertia I_m1",
            "–",
            f"grows throughout: from {lows[0]:.0f} to {lows[-1]:.0f} N/m by (5.7), {highs[0]:.0f} to "
            f"{highs[-1]:.0f} N/m exactly, from a fifth of the inertia to five times; with twice the inertia, "
            f"{motor.doubled[0]:.2f} and {motor.doubled[1]:.2f} times the stiffness. (5.7) levels off at "
            f"{motor.levels_off:.0f} N/m, the other motor's alone",
            bool(np.all(np.diff(lows) > 0.0) and np.all(np.diff(highs) > 0.0)) and lows[-1] < motor.levels_off,
        ),
    ]


def rows() -> list[Row]:
    """The chapter's figures in order."""
    return [
        *dexterity(),
        *impedance_range(),
        *common_area(),
        *base_distance(),
        *elbows(),
        *link_length(),
        *motors(),
        *eigenvalues(),
    ]
