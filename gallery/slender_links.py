"""The bundled five-bar with slender tubes in place of its rigid links, by the three methods.

The links keep their mass, centre of mass and inertia: what the tube does not weigh it carries. Damping is the
file's, 5 % of every mode, those of the beams among them.

Run `python -m gallery.slender_links` for the table, `python docs/make_images.py` for the picture.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from zwidth.chart import StabilityChart
from zwidth.device import Device, from_document
from zwidth.device.load import load
from zwidth.study import bending
from zwidth.study.link_bending import BendingNumbers

DISTAL, DRIVEN = ("distal-right", "distal-left"), ("upper-right", "upper-left")
RIGID = "rigid links"
METHODS = {
    "assumed modes": "assumed-modes",
    "finite elements": "finite-elements",
    "lumped tips": "lumped",
}
# links, outer diameter and wall [mm], material
TUBES: dict[str, tuple[tuple[str, ...], float, float, str]] = {
    "distal, 8 x 0.5 mm": (DISTAL, 8.0, 0.5, "aluminium-6061"),
    "distal, 10 x 1.5 mm of ABS": (DISTAL, 10.0, 1.5, "abs"),
    "driven, 12 x 1 mm": (DRIVEN, 12.0, 1.0, "aluminium-6061"),
    "driven, 10 x 1 mm": (DRIVEN, 10.0, 1.0, "aluminium-6061"),
    "all, 8 x 1 mm": (DISTAL + DRIVEN, 8.0, 1.0, "aluminium-6061"),
}
DRIVES = ("motor-right", "motor-left")
DRIVES_DAMPING_TIME = 1.4e-4  # their dampers over their springs, where dampers are given one by one [s]
RATIOS = (0.0, 0.001, 0.01, 0.02, 0.05)  # of the first vibration of a clamped tube
STIFF_DRIVES: dict[str, Any] = {f"drives.{name}.stiffness_Nm_per_rad": float("inf") for name in DRIVES}


def with_tubes(tubes: str, method: str, changes: dict[str, Any] | None = None) -> Device:
    """The five-bar with these tubes, by a method, and further changes of its numbers."""
    links, diameter, wall, material = TUBES[tubes]
    section = {"shape": "tube", "outer_diameter_m": diameter / 1e3, "wall_m": wall / 1e3}
    beam = {"section": section, "material": material, "method": METHODS[method]}
    return load("five-bar", {f"links.{name}.beam": beam for name in links} | (changes or {}))


def numbers(tubes: str, changes: dict[str, Any] | None = None) -> dict[str, BendingNumbers]:
    """Largest stiffness, static stiffness and first frequency with rigid links and by each method."""
    found: dict[str, BendingNumbers] = {}
    for method in METHODS:
        both = bending(with_tubes(tubes, method, changes))
        assert both is not None
        found |= {RIGID: both.rigid, method: both.bent}
    return found


def largest_by_damping(tubes: str) -> dict[float | None, float]:
    """The largest stiffness by the damping ratio of a clamped tube's first vibration, None with rigid links.

    All dampers are given one by one, those of drives and tubes alike.
    """
    document = load("five-bar").document
    document["mechanism"]["damping"] = {"given": True}
    for drive in document["mechanism"]["drives"]:
        drive["damping_Nms_per_rad"] = DRIVES_DAMPING_TIME * drive["stiffness_Nm_per_rad"]
    found: dict[float | None, float] = {None: from_document(document).at().chart(decay=False).stiffness_max}
    by_name = {link["name"]: link for link in document["mechanism"]["links"]}
    bent = with_tubes(tubes, "assumed modes")
    assert bent.mechanism is not None
    first = 2.0 * np.pi * float(bent.mechanism.flexible[0].frequencies[0])
    beams = {link["name"]: link.get("beam") for link in bent.document["mechanism"]["links"]}
    for ratio in RATIOS:
        for name in TUBES[tubes][0]:
            by_name[name]["beam"] = beams[name] | {"damping_time_s": 2.0 * ratio / first}
        found[ratio] = from_document(document).at().chart(decay=False).stiffness_max
    return found


def charts(tubes: str) -> dict[str, StabilityChart]:
    """The whole charts."""
    found = {RIGID: load("five-bar").at().chart(decay=False)}
    return found | {method: with_tubes(tubes, method).at().chart(decay=False) for method in METHODS}


def draw(made: Any) -> None:
    """Charts with tubes as driven links, whole and close to the stiffest walls, and as distal links."""
    from zwidth.show import draw_models, legend_above

    driven, distal = charts("driven, 12 x 1 mm"), charts("distal, 8 x 0.5 mm")
    panels = made.subplots(3, 1, height_ratios=(1.2, 1.0, 1.0))
    for ax, found, window, title in zip(
        panels,
        (driven, driven, distal),
        ((-200.0, 8700.0, -1.5, 32.0), (7000.0, 8500.0, 0.0, 18.0), (7700.0, 8000.0, 8.0, 13.5)),
        (
            "Driven links as tubes, 12 × 1 mm",
            "The same, close to the stiffest walls",
            "Distal links as tubes, 8 × 0.5 mm, close to the stiffest walls",
        ),
        strict=True,
    ):
        draw_models(ax, found, window)
        for (name, chart), line in zip(found.items(), ax.get_legend().get_lines(), strict=True):
            # the converged methods coincide: a ring about a dot
            size, filled = (7.0, "none") if name == "finite elements" else (3.6, line.get_color())
            at = chart.stiffness_max, chart.damping_at_stiffness_max
            ax.plot(*at, "o", color=line.get_color(), markersize=size, markerfacecolor=filled, zorder=5.0)
        ax.get_legend().remove()
        if ax is panels[0]:
            legend_above(ax, columns=2, title=title)
        else:
            ax.set_title(title, loc="left", fontsize=8.0)


def rows() -> list[str]:
    """The table: largest stiffness, and first frequency that the wall moves, by tubes and method; on the device's
    drives, then on rigid ones."""
    lines = []
    for tubes in TUBES:
        found = numbers(tubes)
        cells = [f"{each.stiffness_max:.0f} N/m, {each.first_mode:.1f} Hz" for each in found.values()]
        static = found["assumed modes"].static_stiffness
        lines.append(f"| {tubes} | {' | '.join(cells)} | {static / 1e3:.2f} kN/m |".replace(" x ", " × "))
    found = numbers("all, 8 x 1 mm", STIFF_DRIVES)
    cells = [f"{each.stiffness_max / 1e3:.1f} kN/m" for each in found.values()]
    firsts = [f", {each.first_mode:.1f} Hz" if np.isfinite(each.first_mode) else "" for each in found.values()]
    row = " | ".join(cell + first for cell, first in zip(cells, firsts, strict=True))
    lines.append(
        f"| all, 8 × 1 mm, on rigid drives | {row} | {found['assumed modes'].static_stiffness / 1e3:.2f} kN/m |"
    )
    return lines


def damping_rows() -> list[str]:
    """The table of damping ratios."""
    found = largest_by_damping("distal, 8 x 0.5 mm")
    return [f"| {_ratio_text(ratio)} | {K:.0f} N/m |" for ratio, K in found.items()]


def _ratio_text(ratio: float | None) -> str:
    return "(rigid links)" if ratio is None else f"{100.0 * ratio:g} %"


if __name__ == "__main__":
    print("\n".join([*rows(), "", *damping_rows()]))
