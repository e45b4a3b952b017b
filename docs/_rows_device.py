"""3.1 and Appendix B: the device's masses, stiffness and frequencies, its kinematics and inertia as printed."""

from __future__ import annotations

from docs._comparison_row import (
    ANOTHER_QUESTION,
    MISPRINT,
    ROUNDED,
    SCAN_DAMAGED,
    UNEXPLAINED,
    Claim,
    Evidence,
    Number,
    Reason,
    Row,
    fits_digits,
    significant,
)
from gallery import appendix_b
from gallery import appendix_b_random as drawn
from gallery import identified_five_bar as identified
from gallery import optimal_mass as optimum
from gallery import table_3_4 as device
from gallery.fig_3_7_bilateral_wall import loop

T = loop.period


def drives() -> list[Row]:
    """3.1.1: transmission ratio, rotor inertia."""
    inertia, small = device.motor_inertia_at_the_joint, device.ratio_of_a_pulley_of_9_8_mm
    return [
        Number(
            "3.1.1",
            "transmission ratio (96 − 4.95)/4.95",
            device.ratio_of_the_pulleys,
            printed="18.6",
            reason=Reason(
                ROUNDED,
                f"“approximately”, from a pulley of “approximately 9.9 mm”: 9.8 mm gives {small:.2f}; the printed "
                f"motor-side mass of 0.0254 kg needs 18.6 ({device.motor_side_mass:.5f} kg, against "
                f"{device.motor_side_mass_with_the_pulleys_ratio:.5f} kg)",
                fits_digits(small, "18.6")
                and fits_digits(device.motor_side_mass, "0.0254")
                and not fits_digits(device.motor_side_mass_with_the_pulleys_ratio, "0.0254"),
            ),
        ),
        Number(
            "3.1.1, Table 3.1",
            "motor inertia at the joint",
            inertia,
            "kg m²",
            printed="1.186e-4",
            reason=Reason(
                MISPRINT,
                f"the first digit: K_g² I_mot = 18.6² · 12.1e-7 kg m² = {inertia:.4g} kg m². The printed value "
                f"makes the motor-side mass {device.motor_side_mass_with_the_printed_inertia:.4f} kg",
                abs(inertia - 18.6**2 * 12.1e-7) < 1e-12
                and not fits_digits(device.motor_side_mass_with_the_printed_inertia, "0.0254"),
                (Evidence("m_e2 in Table 3.4", "0.0254", device.motor_side_mass, "kg"),),
            ),
            digits=4,
        ),
    ]


def masses() -> list[Row]:
    """Table 3.4."""
    high, frequency = device.frequency_of_the_published_plant, device.frequency_with_the_computed_stiffness
    return [
        Number("Tables 3.2, 3.4, (2.43)", "m_e1, link side", device.link_side_mass, "kg", printed="0.2616"),
        Number("Table 3.4", "m_e2, motor side", device.motor_side_mass, "kg", printed="0.0254"),
        Number("Table 3.4, (2.18), (2.42)", "both together, rigid", device.rigid_mass, "kg", printed="0.287"),
        Number(
            "Tables 3.3, 3.4",
            "k_e by (2.34), largest stiffnesses",
            device.stiffness,
            "N/m",
            printed="15620",
            reason=Reason(
                UNEXPLAINED,
                f"15620 N/m puts the two masses at {high:.1f} Hz, where the device has its second frequency "
                f"({device.frequencies[1]:.1f} Hz), and may be fitted to it; {device.stiffness:.0f} N/m puts "
                f"them at {frequency:.1f} Hz",
                abs(high - device.frequencies[1]) < 0.1 < abs(frequency - device.frequencies[1]),
            ),
        ),
        Claim(
            "Table 3.4",
            "sampling period",
            "0.0025 s",
            f"{T} s",
            T == 0.0025,
            Reason(
                MISPRINT,
                "with 0.0025 s the optimal radius of (5.15) at (3000 N/m, 15 N s/m) would be "
                f"{optimum.with_the_printed_period:.4f}",
                not fits_digits(optimum.with_the_printed_period, "0.8956"),
                (
                    Evidence("3.1.3", "800", 1.0 / T, "Hz"),
                    Evidence("5.3.2", "0.8956", optimum.by_5_15["B"]),
                ),
            ),
        ),
    ]


def frequencies() -> list[Row]:
    """3.1.3: natural frequencies of the four-DoF model."""
    first, second = device.frequencies
    low, high = device.frequencies_at_average_stiffness
    coarse = f"to steps of 5 Hz: {low:.2f} and {high:.2f} Hz become 95 and 120 Hz"
    to_five = 5 * round(low / 5) == 95 and 5 * round(high / 5) == 120
    return [
        Number("3.1.3, (2.21), (3.1)", "first natural frequency, largest stiffnesses", first, "Hz", printed="101"),
        Number("3.1.3", "second natural frequency", second, "Hz", printed="131"),
        Number(
            "3.1.3",
            "first natural frequency, average stiffnesses",
            low,
            "Hz",
            printed="95",
            reason=Reason(ROUNDED, coarse, to_five),
        ),
        Number(
            "3.1.3",
            "second natural frequency, average stiffnesses",
            high,
            "Hz",
            printed="120",
            reason=Reason(ROUNDED, coarse, to_five),
        ),
    ]


def kinematics() -> list[Row]:
    """(B.1)-(B.12), at three positions of the thesis's device and on random five-bars."""
    at, exact = f"at {len(appendix_b.POSITIONS)} positions and on {drawn.COUNT} random five-bars", 1e-12
    random = drawn.errors
    damaged = {
        "(B.7)": (
            "minimum-set Jacobian",
            "a matrix over “sin(q1 + q2 + q3 + q4)”",
            "with 1/sin(q1 + q2 − q3 − q4) the engine's Jacobian",
            "the scan has lost minus signs under the fraction",
            max(appendix_b.error_of_B_7, random["B_7"]),
        ),
        "(B.9)–(B.12)": (
            "inverse displacement",
            "a quadratic equation in t = tan(q1/2)",
            "with a1 t² + a2 t + a3 = 0, coefficients in the order of (B.12), the engine's q1 is a root",
            "the scan has lost L1 before sin q1 in (B.10), and garbles the coefficients' names in (B.11) and "
            "(B.12)",
            max(appendix_b.error_of_inverse, random["inverse"]),
        ),
        "(B.18)": (
            "transformation q̇ = B ṗ",
            "a 4 × 2 matrix",
            "with −1 in the row of q2 the constraints hold, and J₁, J₂ times it are the engine's Jacobian",
            "the scan has lost that −1; in the row of q4 it has it",
            max(appendix_b.error_of_B_6, appendix_b.error_of_jacobian, random["B_6"], random["jacobian"]),
        ),
    }
    return [
        Claim(
            "(B.1), (B.2), (B.5)",
            "position by either chain",
            "L1 e^{iq1} + L2 e^{i(q1 + q2)}, and alike for links 3 and 4",
            f"both are the engine's handle, {at}, to rounding",
            max(appendix_b.error_of_position, random["position"]) < exact,
        ),
        Claim(
            "(B.3), (B.4), (B.6)",
            "Jacobians of the chains and of the constraints",
            "J₁, J₂ and ∂Φ/∂q",
            f"J₁ and J₂ times (B.18) are the engine's Jacobian, {at}, to rounding; (B.6) times (B.18) vanishes",
            max(appendix_b.error_of_jacobian, appendix_b.error_of_B_6, random["jacobian"], random["B_6"]) < exact,
        ),
        Claim(
            "(B.8)",
            "passive angles from the driven ones",
            "q2 = asin(L1/L2 sin((q3 − q1)/2)) + (q3 − q1)/2, q4 = 2π − the same of links 3 and 4",
            f"the engine's q2 and q4, at {len(appendix_b.POSITIONS)} positions and on {drawn.COUNT // 2} random "
            "five-bars with equal arms, to rounding; only with these: on as many with unequal arms it misses by "
            f"{drawn.least_error_of_B_8_with_unequal_arms:.3f} to "
            f"{drawn.largest_error_of_B_8_with_unequal_arms:.2f} rad",
            max(appendix_b.error_of_B_8, random["B_8"]) < exact < drawn.least_error_of_B_8_with_unequal_arms,
        ),
        *(
            Claim(
                place, what, printed, f"{ours}, {at}, to rounding", False, Reason(SCAN_DAMAGED, why, error < exact)
            )
            for place, (what, printed, ours, why, error) in damaged.items()
        ),
    ]


def inertia() -> list[Row]:
    """(B.13)-(B.19)."""
    at = f"at {len(appendix_b.POSITIONS)} positions and on {drawn.COUNT} random five-bars"
    rods, offsets = device.link_side_mass_of_appendix_b, device.link_side_mass_of_rods_with_offsets
    ours, straight = device.link_side_mass, device.link_side_mass_without_offsets
    return [
        Claim(
            "(B.15), (B.16)",
            "kinetic energy and mass matrix",
            "of slender distal rods, m L²/12, their centres on the axes",
            f"(B.16) through (B.18) is the engine's mass matrix of these links, {at}, to rounding",
            max(appendix_b.error_of_mass, drawn.errors["mass"]) < 1e-12,
        ),
        Claim(
            "(B.13)–(B.15)",
            "Lagrange's equations",
            "d/dt ∂L/∂ṗ − ∂L/∂p, L = T1 + T2",
            "with T1, T2 by (B.15), the passive joints by where the circles about the elbows meet and complex "
            f"steps for the derivatives, the engine's torques M p̈ + inertia terms, {at} with random rates and "
            "accelerations, to rounding",
            max(drawn.error_of_B_13, drawn.errors["B_13"]) < 1e-12,
        ),
        Claim(
            "(B.15)",
            "its link-side mass",
            "0.2616 kg in Table 3.4",
            f"{rods:.4f} kg",
            fits_digits(rods, "0.2616"),
            Reason(
                ANOTHER_QUESTION,
                f"(B.15) is of slender rods. Table 3.4 needs Table 3.2 as measured, inertias and lateral offsets: "
                f"{ours:.4f} kg ({straight:.4f} kg without the offsets, {offsets:.4f} kg of rods with them)",
                fits_digits(ours, "0.2616") and not any(fits_digits(m, "0.2616") for m in (straight, offsets)),
            ),
        ),
        Claim(
            "(B.17)",
            "nonlinear inertia term",
            "c = −∂T/∂q, with −2 m2 L1 L_c2 sin q2 q̇1 (q̇1 + q̇2) for q2, alike for q4",
            f"with it the torques of (B.19) miss the engine's by {100 * appendix_b.error_of_B_17:.0f} % at "
            f"rates of {significant(appendix_b.RATES[0])} and "
            f"{significant(appendix_b.RATES[1]).replace('-', '−')} rad/s",
            appendix_b.error_of_B_17 < 1e-12,
            Reason(
                UNEXPLAINED,
                "as far as the scan can be read it is −2 times −∂T/∂q, which is ∂(q̇ᵀ M q̇)/∂q; −∂T/∂q itself, "
                "which the text announces, lacks Ṁ q̇ and misses by "
                f"{100 * appendix_b.error_of_slope_alone:.0f} %. c = Ṁ q̇ − ∂T/∂q, which (B.19) needs, gives the "
                f"engine's torques, {at}, to rounding; there the printed one misses by at least "
                f"{100 * min(appendix_b.least_error_of_B_17, drawn.least_error_of_B_17):.0f} %. No number of the "
                "thesis depends on it",
                max(appendix_b.error_of_terms, drawn.errors["terms"])
                < 1e-12
                < min(appendix_b.error_of_slope_alone, appendix_b.least_error_of_B_17, drawn.least_error_of_B_17),
            ),
        ),
        Claim(
            "(B.19)",
            "equations of motion",
            "Bᵀ M B p̈ + Bᵀ (c + M Ḃ ṗ) = Bᵀ Q",
            f"with c = Ṁ q̇ − ∂T/∂q the engine's mass matrix and nonlinear torques, {at}, to rounding",
            max(appendix_b.error_of_mass, appendix_b.error_of_terms, drawn.errors["mass"], drawn.errors["terms"])
            < 1e-12,
        ),
    ]


def identification() -> list[Row]:
    """Table 3.3 as an identification, from deflections that are made up: the thesis's are in no scan."""
    rows: list[Row] = []
    for number, found in enumerate(identified.stiffnesses(), start=1):
        for which, printed in (("largest", identified.LARGEST), ("average", identified.AVERAGE)):
            stiffness = found[f"{which} stiffness"]
            rows.append(
                Number(
                    "Table 3.3, 3.1.3",
                    f"{which} stiffness of drive {number}, identified from deflections that are made up from the "
                    f"printed value, with friction and noise (95 %: {stiffness.low:.4f} to {stiffness.high:.4f})",
                    stiffness.value,
                    "N m/rad",
                    printed=f"{printed[number - 1]:.2f}",
                    digits=4,
                )
            )
    return rows


def rows() -> list[Row]:
    """3.1."""
    return [*drives(), *identification(), *masses(), *frequencies()]


def appendix() -> list[Row]:
    """Appendix B."""
    return [*kinematics(), *inertia()]
