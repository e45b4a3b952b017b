"""Chapter 5: over the workspace, Figs. 5.1 to 5.4; designs and eigenvalues are in modules of their own."""

from __future__ import annotations

from docs._comparison_row import Claim, Number, Row
from docs._rows_designs import designs
from docs._rows_eigenvalues import eigenvalues
from gallery import fig_5_1_workspace as maps
from gallery import fig_5_4_common_area as common

AT = "at (0, 0.25) m"
BY_HAND = 1e-11  # closed forms against each other
ARMS = "the arms written out by hand"


def dexterity() -> list[Row]:
    """Fig. 5.1."""
    low, high = maps.kappa_where_dexterous
    share = maps.isotropic[1.5]
    titles = {
        "manipulability": ("(5.1)", "manipulability", "m²"),
        "dynamic_manipulability": ("(5.3)", "dynamic manipulability", "1/(kg m)²"),
        "isotropy": ("(5.2)", "condition number", ""),
    }
    return [
        *(
            Number(
                f"Fig. 5.1, {place}",
                f"{title} {AT}",
                maps.at_reference[name][0],
                unit,
                second_value=maps.at_reference[name][1],
                tolerance=BY_HAND,
                route=ARMS,
            )
            for name, (place, title, unit) in titles.items()
        ),
        Claim(
            "Fig. 5.1",
            "kinematic isotropy",
            "almost constant and close to unity in most of the workspace, where the manipulabilities are maximum",
            f"the condition number is at most 1.5 in {100 * share:.0f} % of the reachable area "
            f"(y ≥ 0.05 m), at most 2 in {100 * maps.isotropic[2.0]:.0f} %; where both manipulabilities are "
            f"within a tenth of their largest it goes from {low:.2f} to {high:.2f}",
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
    contrast, alike = maps.contrast, maps.rank_correlations
    r, kappa = maps.at_largest("rigid")
    tenth = {model: maps.where_stiffest(model) for model in ("rigid", "flexible")}
    symmetric = max(maps.asymmetries[name] for name in ("rigid", "rigid area"))
    return [
        *(
            Number(
                place,
                f"{text} {AT}",
                maps.stiffest[model],
                "N/m",
                second_value=maps.stiffness_by_brute_force(model),
                tolerance=1e-9,
            )
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
            "where the largest stiffness is best",
            "“at locations where the condition number and manipulability are low”",
            "over the stiffest tenth of the map the median condition number is "
            f"{tenth['rigid'][0]:.2f} times that of the whole map (rigid), {tenth['flexible'][0]:.2f} times "
            f"(flexible), the median manipulability {tenth['rigid'][1]:.2f} and {tenth['flexible'][1]:.2f} "
            f"times. The stiffest place of all, {1e3 * r:.0f} mm from the base, has a condition number of "
            f"{kappa:.1f}: arms nearly folded",
            all(max(ratios) < 1.0 for ratios in tenth.values()),
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
                f"common area, {name} ≥ 0.2 kg "
                f"({100 * common.areas[mass].common.share:.0f} % of the reachable area)",
                1e4 * common.areas[mass].common.area,
                "cm²",
                second_value=1e4 * common.by_integration[mass],
                tolerance=1e-3,
                digits=3,
                route="integration",
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


def rows() -> list[Row]:
    """The chapter's figures in order."""
    return [
        *dexterity(),
        *impedance_range(),
        *common_area(),
        *designs(),
        *eigenvalues(),
    ]
