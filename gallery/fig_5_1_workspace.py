"""Figs. 5.1 to 5.3: dexterity and impedance range over the workspace, x from -0.3 to 0.3 m, y from 0.05 m upwards.

    Fig. 5.1   manipulability (5.1), dynamic manipulability (5.3), condition number of the Jacobian (5.2)
    Fig. 5.2   largest stiffness and stable area of the rigid body, (5.4) and (5.5)
    Fig. 5.3   the same of the motors' mass on the drives' spring, (5.7) and (5.8)

and beside them what the full model, damped as bundled, has exactly. The mass of Fig. 5.2 is that of links and
rotors; (5.4) prints m_e1, the links' alone.

With both base joints in one place the device may be turned about them: what does not speak of a direction depends
on the distance r from the base alone. So Fig. 5.1 has rings, and is known twice: from the map, and along one line.

"In contrast" is taken as a negative rank correlation (Spearman's) over the cells, "similar" as one above 0.9.

Run `python -m gallery.fig_5_1_workspace` to draw them.
"""

from __future__ import annotations

import numpy as np

from gallery.five_bar import brute_force_loop, bundled
from gallery.five_bar_designs import REFERENCE, device, measure_values
from gallery.shared_loops import write_page
from zwidth.measures import rigid_range, sprung_range
from zwidth.study import plane_of, workspace_map

ASSEMBLY = device.reference_assembly
plane = plane_of(device, cells=(121, 61))
dexterity = workspace_map(
    device,
    [
        "manipulability",
        "dynamic_manipulability",
        "isotropy",
        "isotropy_frobenius",
        "link_side_mass",
        "rigid_mass",
        "motor_side_mass",
        "stiffness",
        "stiffness_max",
    ],
    plane,
    workers=1,
)
CLOSED = ["stiffness_max_closed_form", "stable_area_closed_form"]
rigid, flexible = (
    workspace_map(device, CLOSED, plane, model=model, workers=1) for model in ("rigid", "motor-mass")
)

values = {
    "w": dexterity["manipulability"].values,
    "w_d": dexterity["dynamic_manipulability"].values,
    "kappa": dexterity["isotropy"].values,
    "rigid": rigid[CLOSED[0]].values,
    "rigid area": rigid[CLOSED[1]].values,
    "flexible": flexible[CLOSED[0]].values,
    "flexible area": flexible[CLOSED[1]].values,
    "exact": dexterity["stiffness_max"].values,
}
reached = np.isfinite(values["w"])
radius = np.hypot(*np.meshgrid(plane.x, plane.y))


def rank_correlation(one: str, other: str) -> float:
    """Spearman's, over the cells that are reached."""
    ranks = [np.argsort(np.argsort(values[name][reached])).astype(float) for name in (one, other)]
    return float(np.corrcoef(ranks)[0, 1])


def asymmetry(name: str) -> float:
    """Largest difference between x and -x, over the larger of the two."""
    v = values[name]
    return float(np.nanmax(np.abs(v - v[:, ::-1]) / np.maximum(v, v[:, ::-1])))


contrast = {
    (model, measure): rank_correlation(model, measure)
    for model in ("rigid", "flexible", "exact")
    for measure in ("w", "w_d", "kappa")
}
rank_correlations = {
    "stiffness": rank_correlation("rigid", "flexible"),
    "area": rank_correlation("rigid area", "flexible area"),
    "exact": rank_correlation("rigid", "exact"),
}
asymmetries = {name: asymmetry(name) for name in values}
isotropic = {bound: float((values["kappa"][reached] <= bound).mean()) for bound in (1.3, 1.5, 2.0)}

# Along the line x = 0, by hand.
r = np.linspace(0.0521, 0.3459, 2939)
line = bundled().at(np.stack([0.0 * r, r], axis=-1), ASSEMBLY)
_best, _even = int(np.argmax(line.manipulability)), int(np.argmin(line.condition_number))
largest_w, w_there, kappa_there = (float(v[_best]) for v in (r, line.manipulability, line.condition_number))
most_isotropic, kappa_least = float(r[_even]), float(line.condition_number[_even])
# Where both manipulabilities are at least 0.9 of their largest values: least and largest condition number.
_dexterous = (
    reached & (values["w"] >= 0.9 * np.nanmax(values["w"])) & (values["w_d"] >= 0.9 * np.nanmax(values["w_d"]))
)
kappa_where_dexterous = (float(values["kappa"][_dexterous].min()), float(values["kappa"][_dexterous].max()))


def where_stiffest(name: str, share: float = 0.1) -> tuple[float, float]:
    """Medians of condition number and manipulability over the stiffest share of the cells, over those of all."""
    stiffest_cells = reached & (values[name] >= np.quantile(values[name][reached], 1.0 - share))
    return tuple(
        float(np.median(values[k][stiffest_cells]) / np.median(values[k][reached])) for k in ("kappa", "w")
    )


def at_largest(name: str) -> tuple[float, float]:
    """Radius and condition number of the cell in which a measure is largest."""
    cell = np.unravel_index(np.nanargmax(values[name]), radius.shape)
    return float(radius[cell]), float(values["kappa"][cell])


# At the reference position: what zwidth has there, and the same by hand and by brute force.
_place = device.at()
_felt = bundled().at(REFERENCE, ASSEMBLY)
PERIOD = device.controller.sampling_period
_whole = _felt.mass_matrix + np.diag(bundled().rotor)
at_reference = {
    name: (float(measure_values(name, _place).values), float(by_hand))
    for name, by_hand in (
        ("manipulability", _felt.manipulability),
        ("dynamic_manipulability", _felt.manipulability / np.linalg.det(_whole)),
        ("isotropy", _felt.condition_number),
    )
}
_effective = _place.effective
stiffest = {
    model: float(found)
    for model, found in (
        ("rigid", rigid_range(_effective.rigid_mass, PERIOD).stiffness_max),
        ("links", rigid_range(_effective.link_side_mass, PERIOD).stiffness_max),
        ("motor-mass", sprung_range(_effective.motor_side_mass, _effective.stiffness, PERIOD).stiffness_max),
        ("full", measure_values("stiffness_max", _place).values),
    )
}
DAMPING_RATIO = float(device.document["mechanism"]["damping"]["mode_ratio"])


def stiffness_by_brute_force(model: str) -> float:
    """The largest stiffness of a model at the reference position, by brute force."""
    return brute_force_loop(_felt, model, DAMPING_RATIO, PERIOD).largest_stiffness(2.0 * stiffest[model], 400.0)[0]


# The outermost centimetre: dexterity next to the boundary against the best of all.
_rim = reached & (radius > 0.336)
rim = {
    "w": float(values["w"][_rim].max() / values["w"][reached].max()),
    "kappa": float(values["kappa"][_rim].min()),
}


def draw(figure) -> None:
    """Fig. 5.1 in the first row, 5.2 and 5.3 in the second and third, the exact answer beside them."""
    from zwidth.show import draw_map

    panels = (
        (dexterity, "manipulability"),
        (dexterity, "dynamic_manipulability"),
        (dexterity, "isotropy"),
        (rigid, CLOSED[0]),
        (rigid, CLOSED[1]),
        (flexible, CLOSED[0]),
        (flexible, CLOSED[1]),
        (dexterity, "stiffness_max"),
    )
    axes = figure.subplots(4, 2).ravel()
    short = {
        CLOSED[0]: "Largest stiffness, {}",
        CLOSED[1]: "Stable area, {}",
    }
    for ax, (dataset, name) in zip(axes, panels, strict=True):
        if name in short:
            dataset = dataset.copy()
            what = short[name].format("rigid" if dataset.attrs["model"] == "rigid" else "flexible")
            dataset[name] = dataset[name].assign_attrs(title=what)
        draw_map(ax, dataset, name)


if __name__ == "__main__":
    print(
        "at the reference, and by hand:",
        at_reference,
        "by brute force:",
        {m: (v, stiffness_by_brute_force(m)) for m, v in stiffest.items()},
    )
    print("kappa where w and w_d are 0.9 of their largest:", kappa_where_dexterous)
    print("stiffest cells, radius and kappa:", {name: at_largest(name) for name in ("rigid", "flexible", "exact")})
    print("rank correlation with dexterity:", {" ".join(k): f"{v:+.2f}" for k, v in contrast.items()})
    print("rigid against flexible:", {k: f"{v:.2f}" for k, v in rank_correlations.items()})
    print("asymmetry:", {k: f"{v:.2g}" for k, v in asymmetries.items()})
    print("condition number at most:", {k: f"{100 * v:.0f} %" for k, v in isotropic.items()}, "rim:", rim)
    print(f"largest w {w_there:.6f} at r = {largest_w:.4f} m, where kappa = {kappa_there:.3f}")
    print(f"kappa = {kappa_least:.6f} at r = {most_isotropic:.4f} m")
    write_page(draw, "fig-5-1-workspace", 9.0, 11.0)
