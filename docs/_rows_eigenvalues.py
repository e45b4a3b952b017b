"""Chapter 5, fidelity: the eigenvalues' ways, Figs. 5.10 to 5.14, and the optimal masses."""

from __future__ import annotations

from docs._comparison_row import MISPRINT, SCAN_DAMAGED, UNEXPLAINED, Claim, Evidence, Number, Reason, Row
from gallery import fig_5_10_eigenvalues as across
from gallery import fig_5_11_spectral_radii as radii
from gallery import fig_5_12_eigenvalue_paths as over_mass
from gallery import optimal_mass as optimum
from gallery.fig_3_7_bilateral_wall import edges_at_4000


def figure_5_10() -> list[Row]:
    """The chart at 4000 N/m, and point A."""
    slow, fast = across.slow_in, across.fast_out
    moves = across.moves
    K, B = across.point_A
    low, *double = across.real_at_A
    at = "at 4000 N/m"
    return [
        Number(
            "Fig. 5.10",
            f"slow pair enters {at}, lower edge",
            slow.value,
            "N s/m",
            second_value=edges_at_4000[0],
            route="bisection",
        ),
        Number(
            "Fig. 5.10",
            f"fast pair leaves {at}, upper edge",
            fast.value,
            "N s/m",
            second_value=edges_at_4000[1],
            route="bisection",
        ),
        Claim(
            "Fig. 5.10",
            f"where the eigenvalues leave {at}",
            "crossing the imaginary axis",
            f"at {90.0 + across.beyond_the_axis:.2f}° from the real axis, {across.frequency(fast):.1f} Hz: a "
            "quarter of the sampling frequency is 200 Hz",
            fast.outwards and abs(across.beyond_the_axis) < 1.0,
        ),
        Claim(
            "Fig. 5.10",
            "which eigenvalues are high",
            "those that leave originate from the flexible elements",
            f"the pair that leaves has {across.frequency(fast):.0f} Hz, the other {across.frequency(slow):.0f} Hz",
            across.frequency(fast) > 5.0 * across.frequency(slow),
        ),
        Claim(
            "Fig. 5.10",
            "the other eigenvalues, damping from −2 to 35 N s/m",
            "remain inside and change very little",
            f"below {slow.value:.2f} N s/m the slow pair is outside, |z| = {across.slow_at_first:.4f} at −2 "
            f"N s/m. From edge to edge it moves by {moves['slow pair']:.3f}, the real one by {moves['real']:.2f}, "
            f"the fast pair by {moves['fast pair']:.2f}",
            across.slow_at_first < 1.0 and moves["real"] < 0.1,
            Reason(
                UNEXPLAINED,
                "true of the slow pair within the stable walls; the real eigenvalue moves as far as the fast pair",
                across.slow_at_first > 1.0 and moves["real"] > moves["fast pair"] and moves["slow pair"] < 0.1,
            ),
        ),
        Claim(
            "Fig. 5.10",
            f"point A, here ({K:.1f} N/m, {B:.2f} N s/m)",
            "optimal spectral radius; two of the real eigenvalues are collocated",
            f"real eigenvalues {low:.4f}, {double[0]:.5f} and {double[1]:.5f}, a pair of modulus "
            f"{abs(across.pair_at_A):.5f}",
            abs(double[1] - double[0]) < 1e-6 and abs(abs(across.pair_at_A) - double[0]) < 1e-6,
        ),
        Claim(
            "Fig. 5.10",
            "point A in the chart of the rigid body, Fig. 3.9",
            "well inside",
            f"the rigid body's slowest motion shrinks to {across.rigid_at_A:.4f} of itself per sample there",
            across.rigid_at_A < 0.96,
        ),
    ]


def figure_5_11() -> list[Row]:
    """Points B, C and D."""
    two, one, damped = (radii.radius[model] for model in radii.LOOPS)
    places = {
        "B": ("inside both charts", two["B"] < 1.0 and one["B"] < 1.0),
        "C": ("outside that of the single-DoF model", two["C"] < 1.0 < one["C"]),
        "D": ("outside both", min(two["D"], one["D"]) > 1.0),
    }
    return [
        *(
            Claim(
                "Fig. 5.11",
                f"point {name} ({radii.WALLS[name][0]:.0f} N/m, {radii.WALLS[name][1]:.0f} N s/m)",
                printed,
                f"ρ = {two[name]:.4f} with two masses, {one[name]:.4f} with the motor's, undamped "
                f"({damped[name]:.4f} damped)",
                holds,
            )
            for name, (printed, holds) in places.items()
        ),
        Claim(
            "Fig. 5.14",
            "the chart with the optimal mass of D",
            "much larger, D well inside",
            f"{radii.area_ratio:.1f} times the area, {radii.stiffness_ratio:.2f} times the stiffness",
            radii.area_ratio > 2.0 and radii.stiffness_ratio > 2.0,
        ),
    ]


def figures_5_12_to_5_14() -> list[Row]:
    """The left-hand sides."""
    found: list[Row] = []
    for figure, name in zip(("5.12", "5.13", "5.14"), radii.WALLS, strict=True):
        for model in over_mass.MODELS:
            found.append(
                Number(
                    f"Fig. {figure}",
                    f"wall {name}, {model}: stable from a motor-side mass of",
                    over_mass.model_paths[name][model].stable_from,
                    "kg",
                    second_value=over_mass.judged_stable_from(model, name),
                )
            )
    two, one = over_mass.MODELS
    apart = max(abs(each[two] - each[one]) for each in over_mass.at_optimum.values())
    missed = max(over_mass.at_optimum[name][two] - rho for name, (_, rho) in over_mass.fastest_pair.items())
    pairs = ", ".join(f"{name} {1e3 * mass:.1f} g" for name, (mass, _) in over_mass.fastest_pair.items())
    best = {name: each[two].fastest for name, each in over_mass.model_paths.items()}
    whole = ", ".join(f"{name} {rho:.4f} at {1e3 * mass:.1f} g" for name, (mass, rho) in best.items())
    return [
        *found,
        Claim(
            "Figs. 5.12-5.14",
            "the single mass for the fast vibration of two",
            "the high frequency components optimally decay at m_e2,opt",
            f"with the mass of (5.14) the fast pairs of both models differ by at most {apart:.3f} in radius, and "
            f"that of the two masses misses its own best (at {pairs}) by at most {missed:.4f}",
            apart < 0.02 and missed < 0.005,
        ),
        Claim(
            "Figs. 5.12-5.14",
            "least spectral radius of the two masses over the motor's mass",
            None,
            f"{whole}: another mass than (5.14), less than half of it, because the slow pair, which both masses "
            "make and (5.15) does not know, decays last",
            all(
                rho > optimum.optimum[name][1] + 0.05
                and mass < 0.5 * optimum.optimum[name][0]
                and abs(over_mass.radius_by_brute_force(two, name, mass) - rho) < 1e-6
                and all(
                    over_mass.radius_by_brute_force(two, name, share * mass) > rho
                    for share in (0.9, 0.99, 1.01, 1.1)
                )
                for name, (mass, rho) in best.items()
            ),
            route="brute force there and 1 and 10 % beside, to 1e-06",
        ),
    ]


def optimal_spectral_radius() -> list[Row]:
    """(5.15), and its numbers of 5.3.2."""
    mass, rho = ({name: found[i] for name, found in optimum.optimum.items()} for i in (0, 1))
    swapped = {
        unit: Reason(
            MISPRINT,
            "the results of B and C are printed for each other",
            True,
            (
                Evidence("point C at B's wall", for_C, values["B"], unit),
                Evidence("point B at C's wall", for_B, values["C"], unit),
            ),
        )
        for unit, values, for_B, for_C in (("", rho, "0.8729", "0.8956"), ("kg", mass, "0.0603", "0.0510"))
    }
    elsewhere = Reason(
        MISPRINT,
        "both numbers belong to one other wall, (5000, 55); the text, Fig. 5.14 and its caption have (5000, 25)",
        True,
        (
            Evidence("point D at that wall", "0.71627", rho["printed for D"]),
            Evidence("point D at that wall", "0.1315", mass["printed for D"], "kg"),
        ),
    )
    given = (("B", "0.8956"), ("C", "0.8729"), ("printed for D", "0.71627"))
    apart = max(abs(optimum.by_5_15[name] - rho[name]) for name in rho)
    numbers = ", ".join(f"{optimum.by_5_15[name]:.6f}" for name, _ in given)
    return [
        Claim(
            "(5.15)",
            "optimal spectral radius",
            "2 √2 √(k_e k_d Δt + k_d k_p Δt)/√(4 k_d² + 8 k_e k_d Δt + 4 k_d k_p Δt + “KZAL”)",
            f"{numbers} at (3000, 15), (4000, 20) and (5000, 55), by eigenvalues too, to 1e-6",
            False,
            Reason(
                SCAN_DAMAGED,
                "“KZAL” is k_p² (Δt)², which has the unit of the other terms",
                apart < 1e-6,
                tuple(Evidence("5.3.2", printed, optimum.by_5_15[name]) for name, printed in given),
            ),
        ),
        Number("5.3.2", "point B (3000, 15): radius", rho["B"], printed="0.8729", reason=swapped[""]),
        Number("5.3.2", "point B: mass", mass["B"], "kg", printed="0.0603", reason=swapped["kg"]),
        Number("5.3.2", "point C (4000, 20): radius", rho["C"], printed="0.8956", reason=swapped[""]),
        Number("5.3.2", "point C: mass", mass["C"], "kg", printed="0.0510", reason=swapped["kg"]),
        Number("5.3.2", "point D (5000, 25): radius", rho["D"], printed="0.71627", reason=elsewhere),
        Number("5.3.2", "point D: mass", mass["D"], "kg", printed="0.1315", reason=elsewhere),
    ]


def eigenvalues() -> list[Row]:
    """All of it."""
    return [*figure_5_10(), *figure_5_11(), *optimal_spectral_radius(), *figures_5_12_to_5_14()]
