"""Devices whose links bend, as documents of device files, closed by construction where they have loops."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path

import numpy as np

from tests.model.framed_devices import placed, three

FIVE_BAR = tomllib.loads(
    (Path(__file__).parents[2] / "src" / "zwidth" / "device" / "zoo" / "five-bar.toml").read_text(encoding="utf-8")
)
METHODS = {
    "assumed-modes": {"method": "assumed-modes", "modes": 4},
    "finite-elements": {"method": "finite-elements", "elements": 8, "modes": 12},
    "lumped": {"method": "lumped"},
}
MOTOR = {"motor_inertia_kg_m2": 1.2e-6, "transmission_ratio": 15.0}


def tube(outer_mm, wall_mm, **keys):
    section = {"shape": "tube", "outer_diameter_m": outer_mm / 1e3, "wall_m": wall_mm / 1e3}
    return {"section": section, "material": "aluminium-6061", **keys}


def numbers(bending, mass_per_length, **keys):
    """A beam with other stiffnesses in its two planes."""
    return {
        "bending_stiffness_Nm2": bending,
        "torsion_stiffness_Nm2": 0.7 * min(bending),
        "axial_stiffness_N": 2e5 * max(bending),
        "mass_per_length_kg_per_m": mass_per_length,
        "torsional_inertia_per_length_kg_m": 4e-5 * mass_per_length,
        **keys,
    }


def link(name, parent, joint="revolute", **keys):
    return {"name": name, "joint": joint, **({} if parent == "base" else {"parent": parent}), **keys}


def drive(joint, stiffness=None, **keys):
    spring = {} if stiffness is None else {"stiffness_Nm_per_rad": stiffness}
    return {"name": f"{joint}-drive", "joint": joint, **MOTOR, **spring, **keys}


def device(links, drives, joints, direction, *, loops=(), handle=None, damping=None, spatial=True):
    """A document whose reference is where the joints stand."""
    carrier = links[-1]["name"] if handle is None else handle["link"]
    o, R, _ = placed(links, joints)[carrier]
    length = next(each.get("length_m", 0.0) for each in links if each["name"] == carrier)
    at = o + R @ three((handle or {}).get("point_m", (length,)))
    slides = {each["name"] for each in links if each["joint"] == "prismatic"}
    assembly = {
        "joints_rad": {name: q for name, q in joints.items() if name not in slides},
        "joints_m": {name: q for name, q in joints.items() if name in slides},
    }
    return {
        "name": "bending",
        "mechanism": {
            "links": links,
            "loops": list(loops),
            "handle": handle or {"link": carrier},
            "assemblies": {"so": {key: value for key, value in assembly.items() if value}},
            "reference": {
                "position_m": at.tolist() if spatial else at[:2].tolist(),
                "direction": list(direction),
                "assembly": "so",
            },
            "drives": drives,
            "damping": damping or {"mode_ratio": 0.03},
        },
        "loop": {"sampling_period_s": 0.001},
    }


def with_beams(document, **keys):
    """The document with these keys in every beam."""
    changed = copy.deepcopy(document)
    for each in changed["mechanism"]["links"]:
        if "beam" in each:
            each["beam"] |= keys
    return changed


def without_beams(document):
    """The same device with rigid links: those that are their beams alone keep its numbers."""
    changed = copy.deepcopy(document)
    for each in changed["mechanism"]["links"]:
        each.pop("beam", None)
    return changed


def planar_arm():
    """Two links, a weight beside the second one; one drive gives, the other does not."""
    return device(
        [
            link("upper", "base", length_m=0.25, beam=tube(14, 1)),
            link(
                "lower", "upper", length_m=0.2, mass_kg=0.09, center_of_mass_m=[0.11, 0.02],
                inertia_kg_m2=5e-4, beam=tube(10, 1),
            ),
        ],
        [drive("upper", 0.6), drive("lower")],
        {"upper": 0.5, "lower": 1.1},
        (0.0, 1.0),
        spatial=False,
    )  # fmt: skip


def spatial_arm():
    """Three joints about different axes, off the beams, and a body off the last one's axis."""
    return device(
        [
            link("column", "base", length_m=0.0, mass_kg=0.2, inertia_kg_m2=[2e-4, 2e-4, 3e-4]),
            link(
                "upper", "column", origin_m=[0.01, 0.02, 0.1], orientation_rad=[1.3, 0.2, 0.4], length_m=0.22,
                beam=numbers([30.0, 18.0], 0.12),
            ),
            link(
                "lower", "upper", origin_m=[0.18, 0.015, -0.02], orientation_rad=[0.4, -0.7, 0.3],
                axis=[0.2, 1.0, 0.1], length_m=0.19, mass_kg=0.08, center_of_mass_m=[0.12, -0.02, 0.015],
                inertia_kg_m2=[[2e-4, 1e-5, 0.0], [1e-5, 5e-4, 0.0], [0.0, 0.0, 5e-4]],
                beam=numbers([9.0, 14.0], 0.08),
            ),
        ],
        [drive("column", 0.9), drive("upper"), drive("lower", 0.4)],
        {"column": 0.4, "upper": 0.3, "lower": -0.8},
        (0.3, 0.2, 1.0),
        handle={"link": "lower", "point_m": [0.19, 0.01, 0.02]},
    )  # fmt: skip


def five_bar(closes="axis", diameter_mm=8, wall_mm=1, stiffness=(0.45, 0.75)):
    """The bundled five-bar with tubes in place of its links, which keep their masses."""
    document = copy.deepcopy(FIVE_BAR)
    del document["sources"]
    mechanism = document["mechanism"]
    for each in mechanism["links"]:
        each["beam"] = tube(diameter_mm, wall_mm)
    mechanism["loops"][0]["closes"] = closes
    for each, spring in zip(mechanism["drives"], stiffness, strict=True):
        del each["stiffness_Nm_per_rad"]
        each |= {} if spring is None else {"stiffness_Nm_per_rad": spring}
    return document


def light_five_bar(closes="axis"):
    """The same of nothing but tubes, on rigid drives."""
    document = five_bar(closes, stiffness=(None, None))
    for each in document["mechanism"]["links"]:
        for key in ("mass_kg", "center_of_mass_m", "inertia_kg_m2"):
            del each[key]
    return document


def spatial_loop():
    """A driven beam, a rigid coupler on a universal joint, and a passive beam that it meets beside its axis."""
    links = [
        link(
            "crank", "base", orientation_rad=[0.3, -0.2, 0.1], axis=[0.1, 0.3, 1.0], length_m=0.12,
            beam=tube(8, 1),
        ),
        link(
            "coupler", "crank", "universal", axis=[0.0, 0.0, 1.0], second_axis=[0.0, 1.0, 0.0], length_m=0.25,
            mass_kg=0.05, center_of_mass_m=[0.1, 0.01, 0.005], inertia_kg_m2=[2e-5, 3e-4, 3e-4],
        ),
        link(
            "rocker", "base", origin_m=[0.3, 0.05, 0.02], orientation_rad=[0.5, 0.4, 1.2], axis=[0.3, -0.2, 1.0],
            length_m=0.2, mass_kg=0.1, center_of_mass_m=[0.12, 0.01, 0.01], inertia_kg_m2=[3e-5, 6e-4, 6e-4],
            beam=tube(9, 1),
        ),
    ]  # fmt: skip
    joints = {"crank": 1.1, "coupler": [-0.9, 0.2], "rocker": 0.6}
    frames = placed(links, joints)
    tip = frames["coupler"][0] + frames["coupler"][1][:, 0] * 0.25
    o, R, _ = frames["rocker"]
    meeting = {"name": "meeting", "links": ["coupler", "rocker"]}
    return device(
        links,
        [drive("crank", 0.5)],
        joints,
        (-0.5, 0.2, 1.0),
        loops=[meeting | {"points_m": [[0.25, 0.0, 0.0], (R.T @ (tip - o)).tolist()]}],
        handle={"link": "rocker", "point_m": [0.2, 0.0, 0.01]},
    )


def slides():
    """A beam that turns, one that slides out of its tip, and one across that hangs on the latter."""
    return device(
        [
            link("swing", "base", length_m=0.2, beam=tube(16, 1)),
            link("ram", "swing", "prismatic", axis=[1.0, 0.3, 0.0], length_m=0.15, beam=tube(10, 1)),
            link("hook", "ram", "fixed", orientation_rad=[0.2, 0.1, 1.2], length_m=0.1, beam=tube(6, 1)),
        ],
        [drive("swing", 0.8), drive("ram", 0.5, transmission_ratio=150.0)],
        {"swing": 0.4, "ram": 0.05},
        (0.5, 1.0, 0.2),
    )


DEVICES = {
    "planar arm": planar_arm,
    "spatial arm": spatial_arm,
    "five-bar, hinge": five_bar,
    "five-bar, point": lambda: five_bar("point"),
    "light five-bar": light_five_bar,
    "spatial loop": spatial_loop,
    "slides": slides,
}


def random_direction(rng, size=3):
    u = rng.normal(size=size)
    return u / np.linalg.norm(u)
