"""Fig. 5.4: where manipulability, condition number and effective mass are good enough at once.

    w >= 0.015 m^2        kappa <= 1.3        m >= 0.2 kg along y

"effective mass m_e1 = 0.2 kg" is that of the links by name; the largest stiffness of the rigid body goes with
links and rotors together. Both are here.

The areas are known twice. From the map: the margins are interpolated between its cells, and the regions they cut
out are intersected. And by integration: with both base joints in one place the device may be turned about them, so
that w and kappa depend on the distance r alone, and the mass along y on r and the angle a from the radius,
1/m = cos^2 a/m_r + sin^2 a/m_t with the masses felt along the radius and across it. So the common area is

    integral over rings of good w and kappa of 2 (a_2 - a_1)(r) r dr,        y >= 0.05 m

The reference position itself is not in it: its condition number is 1.376.

Run `python -m gallery.fig_5_4_common_area` to draw it.
"""

from __future__ import annotations

import numpy as np

from gallery import fig_5_1_workspace as maps
from gallery.five_bar import bundled
from gallery.five_bar_designs import REFERENCE, device
from gallery.shared_loops import write_page
from zwidth.study import common_area, parse_requirement

BOUNDS = {"manipulability": 0.015, "isotropy": 1.3, "mass": 0.2}
MASSES = ("link_side_mass", "rigid_mass")
LOWEST = float(maps.plane.y[0])

areas = {
    mass: common_area(
        maps.dexterity,
        [
            parse_requirement(text)
            for text in (
                f"manipulability>={BOUNDS['manipulability']}",
                f"isotropy<={BOUNDS['isotropy']}",
                f"{mass}>={BOUNDS['mass']}",
            )
        ],
    )
    for mass in MASSES
}


def felt_on_rings(r: np.ndarray) -> dict[str, np.ndarray]:
    """w, kappa, and the masses along the radius and across it."""
    on_y = np.stack([0.0 * r, r], axis=-1)
    along = bundled().at(on_y, maps.ASSEMBLY)
    rotors = np.zeros_like(along.mass_matrix)
    rotors[..., 0, 0], rotors[..., 1, 1] = bundled().rotor
    found = {"w": along.manipulability, "kappa": along.condition_number}
    for name, M in (("link_side_mass", along.mass_matrix), ("rigid_mass", along.mass_matrix + rotors)):
        W = along.jacobian @ np.linalg.solve(M, np.swapaxes(along.jacobian, -1, -2))
        found[name] = np.stack([1.0 / W[..., 1, 1], 1.0 / W[..., 0, 0]], axis=-1)
    return found


def integrated(mass: str, rings: int = 20001) -> float:
    """The common area by integration over rings [m^2]."""
    edges = np.linspace(LOWEST + 2.5e-3, float(np.hypot(0.3, LOWEST)), rings)
    r = 0.5 * (edges[1:] + edges[:-1])
    felt = felt_on_rings(r)
    good = (felt["w"] >= BOUNDS["manipulability"]) & (felt["kappa"] <= BOUNDS["isotropy"])
    radial, across = felt[mass][..., 0], felt[mass][..., 1]
    # 1/m <= 1/bound: s = sin^2 of the angle between the radius and y, at most (or at least) this
    s = (1.0 / BOUNDS["mass"] - 1.0 / radial) / (1.0 / across - 1.0 / radial)
    turn = np.arcsin(np.sqrt(np.clip(s, 0.0, 1.0)))
    lowest = np.arccos(np.minimum(LOWEST / r, 1.0))  # where the ring leaves y >= 0.05 m
    widest = np.where(across < radial, np.minimum(turn, lowest), np.maximum(lowest - turn, 0.0))
    return float(np.sum(np.where(good, 2.0 * widest * r, 0.0) * np.diff(edges)))


by_integration = {mass: integrated(mass) for mass in MASSES}
at_reference = {
    name: float(values)
    for name, values in (
        ("manipulability", bundled().at(REFERENCE, maps.ASSEMBLY).manipulability),
        ("isotropy", bundled().at(REFERENCE, maps.ASSEMBLY).condition_number),
        ("link_side_mass", bundled().at(REFERENCE, maps.ASSEMBLY).link_side_mass),
    )
}


def _distance() -> float:
    import shapely

    return float(areas["link_side_mass"].common.shape.distance(shapely.Point(*REFERENCE)))


# From the reference position to the nearest point of the common area [m].
distance_from_reference = _distance()


def draw(figure) -> None:
    """The requirements over the largest stiffness of the rigid body, with the mass that (5.4) names."""
    from zwidth.show import draw_map

    ax = figure.subplots()
    dataset = maps.dexterity.assign({"stiffness_max_closed_form": maps.rigid["stiffness_max_closed_form"]})
    dataset["stiffness_max_closed_form_status"] = maps.rigid["stiffness_max_closed_form_status"]
    dataset["stiffness_max_closed_form"] = dataset["stiffness_max_closed_form"].assign_attrs(
        title="Largest virtual stiffness, rigid (5.4)"
    )
    draw_map(ax, dataset, "stiffness_max_closed_form", device, areas["link_side_mass"])


if __name__ == "__main__":
    for mass, found in areas.items():
        print(
            f"{mass}: common area {1e4 * found.common.area:.2f} cm² ({1e4 * by_integration[mass]:.2f} by "
            f"integration), {100 * found.common.share:.1f} % of what is reached"
        )
    print("at the reference:", at_reference, f"{1e3 * distance_from_reference:.1f} mm from the common area")
    write_page(draw, "fig-5-4-common-area", 6.4, 4.8)
