"""[mechanism.links.beam]: what is wrong in it, what looks wrong, and every question to a device that has it."""

from __future__ import annotations

import copy
import warnings

import numpy as np
import pytest

from tests.device.device_cases import faults
from tests.model.beam_devices import (
    device,
    drive,
    five_bar,
    light_five_bar,
    link,
    numbers,
    planar_arm,
    spatial_loop,
    tube,
    with_beams,
    without_beams,
)
from zwidth.device import bundled_names, from_document, implausible
from zwidth.device.load import load
from zwidth.loop import Loop
from zwidth.model import Load, Plant

UPPER, LOWER = "mechanism.links.upper", "mechanism.links.lower"
GIVEN = numbers([3.0, 2.0], 0.1)
SHARED = ("mass_kg", "inertia_kg_m2", "center_of_mass_m")


def section(**keys):
    """A change of the first link's section."""
    return lambda links: links[0]["beam"]["section"].update(keys)


def beam(index=0, **keys):
    return lambda links: links[index]["beam"].update(keys)


def of_link(index, **keys):
    return lambda links: links[index].update(keys)


def left_out(index, *path):
    def change(links):
        table = links[index]
        for step in path[:-1]:
            table = table[step]
        del table[path[-1]]

    return change


def box(**keys):
    shape = {"shape": "rectangular-tube", "width_m": 0.02, "height_m": 0.01, "wall_m": 0.001, **keys}
    return lambda links: links[0]["beam"].update(section=shape)


FAULTS = {
    "no diameter": (
        section(outer_diameter_m=0.0),
        f"{UPPER}.beam.section.outer_diameter_m",
        "greater than 0, got 0",
    ),
    "no wall": (section(wall_m=0.0), f"{UPPER}.beam.section.wall_m", "must be greater than 0, got 0"),
    "thick wall": (
        section(wall_m=0.008),
        f"{UPPER}.beam.section.wall_m",
        "more than half of 0.014 m, which leaves",
    ),
    "thick wall of a box": (box(wall_m=0.006), f"{UPPER}.beam.section.wall_m", "more than half of 0.01 m"),
    "no width": (box(width_m=-1.0), f"{UPPER}.beam.section.width_m", "must be greater than 0, got -1"),
    "a thousand metres": (box(width_m=2e3), f"{UPPER}.beam.section.width_m", "is the unit right?"),
    "another shape": (section(shape="pipe"), f"{UPPER}.beam.section.shape", "got 'pipe'"),
    "a key of another shape": (section(diameter_m=0.01), f"{UPPER}.beam.section.diameter_m", 'set shape = "rod"'),
    "length 0": (of_link(0, length_m=0.0), f"{UPPER}.length_m", "is the length of the beam, and must be above 0"),
    "no length": (left_out(0, "length_m"), f"{UPPER}.length_m", "leave beam out of a rigid link"),
    "too heavy": (of_link(1, mass_kg=0.001), f"{LOWER}.mass_kg", "the beam alone weighs 0.0152681 kg"),
    "inertia": (of_link(1, inertia_kg_m2=1e-6), f"{LOWER}.inertia_kg_m2", "leaves -5.909e-05 kg m² for what"),
    "modes of a lump": (
        beam(method="lumped", modes=2),
        f"{UPPER}.beam.modes",
        "does not go with method = 'lumped'",
    ),
    "elements of a lump": (beam(method="lumped", elements=2), f"{UPPER}.beam.elements", "method = 'lumped'"),
    "elements of modes": (beam(elements=2), f"{UPPER}.beam.elements", "does not go with method = 'assumed-modes'"),
    "more modes than elements have": (
        beam(method="finite-elements", elements=1, modes=20),
        f"{UPPER}.beam.modes",
        "at most 2 modes, all that the elements have beside the static deflections, got 20; give more elements",
    ),
    "another method": (beam(method="modal"), f"{UPPER}.beam.method", "got the text 'modal'"),
    "fewer modes than none": (beam(modes=-1), f"{UPPER}.beam.modes", "must be at least 0, got -1"),
    "half a mode": (beam(modes=2.5), f"{UPPER}.beam.modes", "must be a whole number, got 2.5"),
    "no material": (left_out(0, "beam", "material"), f"{UPPER}.beam.material", "is missing; a section needs one"),
    "no section": (left_out(0, "beam", "section"), f"{UPPER}.beam.section", "is missing; a material needs one"),
    "another material": (beam(material="aluminum"), f"{UPPER}.beam.material", "did you mean 'aluminium-6061'?"),
    "a soft material": (
        beam(material={"youngs_modulus_Pa": 1e9, "shear_modulus_Pa": 0.0, "density_kg_per_m3": 1e3}),
        f"{UPPER}.beam.material.shear_modulus_Pa",
        "must be greater than 0, got 0",
    ),
    "some stiffnesses": (
        of_link(0, beam={"bending_stiffness_Nm2": 3.0, "axial_stiffness_N": 1e6}),
        f"{UPPER}.beam",
        "lacks torsion_stiffness_Nm2, mass_per_length_kg_per_m, torsional_inertia_per_length_kg_m",
    ),
    "nothing": (of_link(0, beam={}), f"{UPPER}.beam", "lacks bending_stiffness_Nm2, torsion_stiffness_Nm2"),
    "no table": (of_link(0, beam="rod"), f"{UPPER}.beam", "must be a table, got the text 'rod'"),
    "three bending stiffnesses": (
        of_link(0, beam=GIVEN | {"bending_stiffness_Nm2": [1.0, 2.0, 3.0]}),
        f"{UPPER}.beam.bending_stiffness_Nm2",
        "must have at most 2 elements, got 3",
    ),
    "no bending stiffness": (
        of_link(0, beam=GIVEN | {"bending_stiffness_Nm2": [0.0, 2.0]}),
        f"{UPPER}.beam.bending_stiffness_Nm2.0",
        "must be greater than 0, got 0",
    ),
    "numbers beside a section": (
        beam(bending_stiffness_Nm2=3.0),
        f"{UPPER}.beam.bending_stiffness_Nm2",
        "stands beside section",
    ),
    "mass alone": (of_link(0, mass_kg=0.1), f"{UPPER}.inertia_kg_m2", "or neither for the beam's own"),
    "inertia alone": (of_link(0, inertia_kg_m2=0.1), f"{UPPER}.mass_kg", "or neither for the beam's own"),
    "centre alone": (
        of_link(0, center_of_mass_m=[0.1]),
        f"{UPPER}.center_of_mass_m",
        "remove it for the beam's own",
    ),
    "negative damping": (beam(damping_time_s=-1.0), f"{UPPER}.beam.damping_time_s", "must be at least 0, got -1"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_a_fault_of_a_beam_is_one_sentence_on_its_key(case):
    change, where, words = FAULTS[case]
    document = planar_arm()
    change(document["mechanism"]["links"])
    (found,) = faults(document)
    assert found.key == where
    assert words in found.message


def test_a_beam_of_a_leg_is_named_where_it_is_written():
    document = load("stamper-delta").document
    legs = copy.deepcopy(document)
    arm = legs["mechanism"]["legs"][0]["links"][0]
    arm["beam"] = tube(1e3 * arm["length_m"], 1e3 * arm["length_m"] / 4)  # far heavier than the arm
    (found,) = faults(legs)
    assert found.key.startswith("mechanism.legs.")
    assert found.key.endswith(f"links.{arm['name']}.mass_kg")


def test_an_arm_that_holds_the_handle_does_not_bend():
    document = planar_arm() | {
        "arm": {
            "links": [link("forearm", "base", length_m=0.3, mass_kg=1.0, inertia_kg_m2=0.01)],
            "hand": {"link": "forearm"},
            "posture": {"joints_rad": {"forearm": 0.2}},
            "grasp": "rigid",
        }
    }  # fmt: skip
    from_document(document)
    document["arm"]["links"][0]["beam"] = tube(30, 3)
    assert [fault.key for fault in faults(document)] == ["arm.links.forearm.beam"]


# --- what a link is ---------------------------------------------------------------------------------


def test_a_link_with_a_beam_alone_weighs_as_much():
    found = from_document(light_five_bar()).mechanism.links
    L, m = 0.147, 2700.0 * np.pi / 4.0 * (0.008**2 - 0.006**2) * 0.147
    assert found.mass[0] == pytest.approx(m)
    assert found.center_of_mass[0] == pytest.approx([L / 2, 0.0, 0.0])
    polar = 2700.0 * np.pi / 32.0 * (0.008**4 - 0.006**4) * L
    assert found.inertia[0] == pytest.approx(np.diag([polar, m * L**2 / 12.0, m * L**2 / 12.0]))


@pytest.mark.parametrize("keys", [SHARED, ("mass_kg", "inertia_kg_m2")])
def test_the_numbers_of_a_whole_link_are_those_of_the_beam_and_what_it_carries(keys):
    document = planar_arm()
    found = from_document(document)
    beam_, given = found.mechanism.flexible[1], document["mechanism"]["links"][1]
    own = beam_.beam.mass_per_length * beam_.beam.length
    assert own + beam_.carried_mass == pytest.approx(given["mass_kg"])
    centre = own * np.array([0.1, 0.0, 0.0]) + beam_.carried_mass * beam_.carried_center
    assert centre / given["mass_kg"] == pytest.approx([*given["center_of_mass_m"], 0.0])
    rigid = from_document(without_beams_of(document, own=0)).at()
    assert found.at().mass_matrix == pytest.approx(rigid.mass_matrix, rel=1e-12)


def without_beams_of(document, own):
    """The same with rigid links, of which the one that is its beam alone keeps its numbers."""
    links, rigid = from_document(document).mechanism.links, without_beams(document)
    rigid["mechanism"]["links"][own] |= {
        "mass_kg": float(links.mass[own]),
        "center_of_mass_m": links.center_of_mass[own].tolist(),
        "inertia_kg_m2": np.diag(links.inertia[own]).tolist(),
    }
    return rigid


def test_sections_by_numbers_are_those_by_shapes():
    E, G, rho, D, d = 68.9e9, 26e9, 2700.0, 0.014, 0.012
    A, I = np.pi / 4.0 * (D**2 - d**2), np.pi / 64.0 * (D**4 - d**4)
    by_shape, by_numbers = planar_arm(), planar_arm()
    by_numbers["mechanism"]["links"][0]["beam"] = {
        "bending_stiffness_Nm2": E * I,
        "torsion_stiffness_Nm2": 2.0 * G * I,
        "axial_stiffness_N": E * A,
        "mass_per_length_kg_per_m": rho * A,
        "torsional_inertia_per_length_kg_m": 2.0 * rho * I,
    }
    one, other = (from_document(each).mechanism.flexible[0].beam for each in (by_shape, by_numbers))
    assert list(vars(one).values()) == pytest.approx(list(vars(other).values()), rel=1e-12)


# --- what looks wrong -------------------------------------------------------------------------------


def warned(document):
    return {fault.key: fault.message for fault in implausible(from_document(document))}


@pytest.mark.parametrize("make", [planar_arm, five_bar, light_five_bar, spatial_loop])
def test_plausible_beams_are_not_warned_of(make):
    assert warned(make()) == {}


def test_bundled_devices_are_not_warned_of():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in bundled_names():
            load(name)


SLIPS = {
    "mm": (section(outer_diameter_m=14.0, wall_m=1.0), f"{UPPER}.beam.section.outer_diameter_m", "write 0.014"),
    "GPa": (
        beam(material={"youngs_modulus_Pa": 70.0, "shear_modulus_Pa": 26e9, "density_kg_per_m3": 2700.0}),
        f"{UPPER}.beam.material.youngs_modulus_Pa",
        "if it is in GPa, write 7e+10",
    ),
    "MPa": (
        beam(material={"youngs_modulus_Pa": 70e9, "shear_modulus_Pa": 26e3, "density_kg_per_m3": 2700.0}),
        f"{UPPER}.beam.material.shear_modulus_Pa",
        "if it is in MPa, write 2.6e+10",
    ),
    "g/cm^3": (
        beam(material={"youngs_modulus_Pa": 70e9, "shear_modulus_Pa": 26e9, "density_kg_per_m3": 2.7}),
        f"{UPPER}.beam.material.density_kg_per_m3",
        "if it is in g/cm³, write 2700",
    ),
}


@pytest.mark.parametrize("unit", SLIPS)
def test_a_slipped_unit_is_named(unit):
    change, path, words = SLIPS[unit]
    document = planar_arm()
    change(document["mechanism"]["links"])
    assert words in warned(document)[path]


def stiff_arm(factor):
    """One link, a beam with the first frequency 1.875^2/(2 pi L^2) sqrt(EI/m), so many times half the rate."""
    L, m = 0.2, 0.1
    EI = m * (factor * 500.0 * 2.0 * np.pi * L**2 / 1.8751040687**2) ** 2
    stiff = numbers([EI, EI], m) | {"axial_stiffness_N": 1e14, "torsion_stiffness_Nm2": 1e12}
    return device(
        [link("arm", "base", length_m=L, beam=stiff)], [drive("arm")], {"arm": 0.2}, (0.0, 1.0), spatial=False
    )


def test_what_is_called_as_good_as_rigid_is():
    """Rigid drives, so that nothing else gives: without bending the stiffest wall is stiffer by less than 1 %."""
    document = light_five_bar()
    for each in document["mechanism"]["links"]:
        each["beam"] = tube(80, 3)
    named = [path for path, message in warned(document).items() if "as good as rigid" in message]
    assert named == ["mechanism.links.distal-right.beam", "mechanism.links.distal-left.beam"]
    own = from_document(document).at().chart(decay=False).stiffness_max
    for index in (1, 3):
        rigid = copy.deepcopy(document)
        material = {"youngs_modulus_Pa": 68.9e16, "shear_modulus_Pa": 26e16, "density_kg_per_m3": 2700.0}
        rigid["mechanism"]["links"][index]["beam"]["material"] = material
        stiffer = from_document(rigid).at().chart(decay=False).stiffness_max
        assert 0.0 < abs(stiffer / own - 1.0) < 0.01


def test_what_a_link_carries_counts():
    """The same beam with a weight at its tip bends slowly enough."""
    document = stiff_arm(10.2)
    link_ = document["mechanism"]["links"][0]
    m, L = 0.1 * 0.2, 0.2
    link_ |= {"mass_kg": m + 0.05, "center_of_mass_m": [(m * L / 2 + 0.05 * L) / (m + 0.05)]}
    spread = m * 0.05 / (m + 0.05) * (L / 2) ** 2
    link_["inertia_kg_m2"] = m * L**2 / 12.0 + spread + 1e-9
    assert warned(document) == {}


@pytest.mark.parametrize(
    "keys", [{"method": "assumed-modes", "modes": 12}, {"method": "finite-elements", "elements": 30, "modes": 20}]
)
def test_modes_in_vain_are_named(keys):
    """As few as the sentence asks for are enough, and change nothing."""
    document = with_beams(light_five_bar(), **keys)
    found = warned(document)
    path = "mechanism.links.upper-right.beam.modes"
    assert "write modes = " in found[path]
    fewer = copy.deepcopy(document)
    for each in fewer["mechanism"]["links"]:
        message = found.get(f"mechanism.links.{each['name']}.beam.modes")
        if message:
            each["beam"]["modes"] = int(message.rpartition("modes = ")[2])
    assert warned(fewer) == {}
    one, other = (from_document(each).at().chart(decay=False).stiffness_max for each in (document, fewer))
    assert one == pytest.approx(other, rel=1e-6)


def test_a_device_without_a_sampling_period_is_not_warned_of():
    document = stiff_arm(50.0)
    del document["loop"]["sampling_period_s"]
    assert warned(document) == {}


# --- studies ----------------------------------------------------------------------------------------


def test_a_softer_link_can_raise_the_largest_stiffness():
    """Two masses, 5 % of damping, the spring between them as soft again by half: 7.2 to 8.4 kN/m."""

    def chart(k):
        m1, m2 = 0.2616, 0.0254
        b = 2.0 * 0.05 * np.sqrt(k * m1 * m2 / (m1 + m2))
        return Loop(Plant.two_masses(m1, m2, k, b), sampling_period=0.00125).chart(decay=False).stiffness_max

    stiff, soft = chart(15620.0), chart(10383.0)
    assert stiff == pytest.approx(7.2e3, rel=0.01)
    assert soft == pytest.approx(8.4e3, rel=0.01)
    assert chart(1e7) > 10.0 * soft


def test_bending_moves_the_largest_stiffness_of_a_five_bar_either_way():
    """On flexible drives it rises, as of the two masses; on rigid ones bending is all that limits it."""
    rigid = from_document(without_beams(five_bar())).at().chart(decay=False).stiffness_max
    charts = {
        D: from_document(five_bar(diameter_mm=D)).at().chart(decay=False).stiffness_max / rigid for D in (12, 8, 5)
    }
    assert 1.04 < charts[12] < 1.06
    assert 1.0 < charts[8] < 1.01
    stiff = five_bar(stiffness=(None, None))
    on_rigid = from_document(without_beams(stiff)).at().chart(decay=False).stiffness_max
    assert from_document(stiff).at().chart(decay=False).stiffness_max < 0.7 * on_rigid


def test_settings_and_sweeps_reach_into_a_section():
    thin = from_document(five_bar()).with_({"links.distal-right.beam.section.wall_m": 0.0005})
    document = five_bar()
    document["mechanism"]["links"][1]["beam"]["section"]["wall_m"] = 0.0005
    assert thin.at().plant.mass == pytest.approx(from_document(document).at().plant.mass, rel=1e-12)


def test_a_load_and_an_operator_and_encoders_on_links_go_together():
    document = planar_arm()
    document["loop"]["encoder"] = {"at": "link"}
    at = from_document(document).at(operator="thesis-arm", load=Load(push=-0.5))
    assert at.chart(decay=False).stiffness_max > 100.0
