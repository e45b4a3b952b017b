"""Links that bend are linearised at the straight shape: under load answers say so, and nothing is guaranteed."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.device import from_document
from zwidth.loop.linear_omissions import STRAIGHT
from zwidth.show.app.layers import _guarantees
from zwidth.show.circumstances import omission_text
from zwidth.show.figures.caption import facts_of_point

BEAM = {
    "bending_stiffness_Nm2": 4.0,
    "torsion_stiffness_Nm2": 8.0,
    "axial_stiffness_N": 1e6,
    "mass_per_length_kg_per_m": 0.2,
    "torsional_inertia_per_length_kg_m": 1e-6,
    "modes": 1,
}
BODY = {"mass_kg": 0.2, "center_of_mass_m": [0.1], "inertia_kg_m2": [1e-4, 6e-4, 6e-4]}


def arm(bends, **more):
    """Two links in a plane, of which the second one bends or not."""
    links = [
        {"name": "upper", "joint": "revolute", "length_m": 0.2, **BODY},
        {
            "name": "lower",
            "parent": "upper",
            "joint": "revolute",
            "length_m": 0.2,
            **({"beam": BEAM} if bends else BODY),
        },
    ]
    drives = [
        {"name": name, "joint": joint, "motor_inertia_kg_m2": 5e-6, "transmission_ratio": 10.0}
        for name, joint in (("shoulder", "upper"), ("elbow", "lower"))
    ]
    a, b = 0.5, 1.2
    mechanism = {
        "links": links,
        "drives": drives,
        "handle": {"link": "lower"},
        "reference": {
            "position_m": [0.2 * (np.cos(a) + np.cos(a + b)), 0.2 * (np.sin(a) + np.sin(a + b))],
            "direction": [1.0, 0.0],
            "assembly": "left",
        },
        "damping": {"mode_ratio": 0.02},
        "assemblies": {"left": {"joints_rad": {"upper": a, "lower": b}}},
    }
    return from_document({"name": "arm", "mechanism": mechanism, "loop": {"sampling_period_s": 0.001}} | more)


@pytest.mark.parametrize(
    ("bends", "load", "gravity", "model", "omitted"),
    [
        (True, (0.5, 0.0), None, None, (STRAIGHT,)),
        (True, None, (0.0, -9.81), None, (STRAIGHT,)),
        (True, None, None, None, ()),
        (True, None, (0.0, 0.0), None, ()),
        (True, (0.5, 0.0), None, "rigid", ()),
        (False, (0.5, 0.0), None, None, ()),
    ],
)
def test_the_caveat_is_where_links_bend_and_something_loads_them(bends, load, gravity, model, omitted):
    device = arm(bends)
    device = device if load is None and gravity is None else device.under(load, gravity)
    assert device.omissions(model) == omitted
    if model is None and gravity is None:
        point = device.at()
        assert point.load_omissions == omitted
        assert (STRAIGHT in repr(point)) == bool(omitted)
        assert tuple(facts_of_point(point)["left_out"]) == omitted
        assert tuple(facts_of_point(point, linear=False)["left_out"]) == omitted


def test_words_are_made_in_one_place():
    assert omission_text([STRAIGHT]) == STRAIGHT
    assert omission_text(["dry friction", STRAIGHT]).endswith(f"dry friction; {STRAIGHT}")


def test_nothing_is_guaranteed_of_links_that_bend_under_load():
    point = arm(bends=True).under((0.5, 0.0)).at()
    found = point.guarantees(coupling=True)
    assert found.refusal
    assert found.is_empty
    assert all(one.region.rings == () for one in found.guarantees)
    assert found.couplings.reason == found.refusal
    head, _ = _guarantees(point, None, None, None)
    assert head["caveats"]
    assert all(one["reason"] == found.refusal for one in head["regions"].values())
