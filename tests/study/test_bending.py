"""What it changes that links bend, against closed forms and devices built another way."""

from __future__ import annotations

import copy
import tomllib

import numpy as np
import pytest
from scipy.optimize import brentq

import zwidth
from tests.model.beam_devices import (
    device,
    drive,
    five_bar,
    light_five_bar,
    link,
    spatial_arm,
    tube,
    with_beams,
    without_beams,
)
from zwidth.device import from_document, new_device
from zwidth.errors import MissingNumbersError, OperatingPointError
from zwidth.model import natural_frequencies
from zwidth.study.link_bending import DAMPING, FIRST_ROOT, LEAST_SHARE, SHARE, THICKEST, WALL, with_rigid_links

E, RHO = 68.9e9, 2700.0  # of aluminium 6061 [Pa], [kg/m^3], as `zwidth.model.beam_section` has them
RATIO, ROTOR = 15.0, 1.2e-6  # of `drive`
LENGTH = 0.3


def template(kind):
    return from_document(tomllib.loads(new_device("a template", kind)))


def section_of(outer, wall):
    """Mass per length [kg/m] and E I [N m^2] of a tube."""
    inner = outer - 2.0 * wall
    return RHO * np.pi / 4.0 * (outer**2 - inner**2), E * np.pi / 64.0 * (outer**4 - inner**4)


def one_link(stiffness=40.0, **keys):
    """One link that turns about the base, the handle at its tip, rendered across it."""
    body = {"length_m": LENGTH, **keys}
    return device(
        [link("arm", "base", **body)], [drive("arm", stiffness)], {"arm": 0.0}, (0.0, 1.0), spatial=False
    )


def uniform(mass, **keys):
    """A uniform thin rod: its mass, centre and inertia about z."""
    return {"mass_kg": mass, "center_of_mass_m": [LENGTH / 2.0], "inertia_kg_m2": mass * LENGTH**2 / 12.0, **keys}


# --- beams of the file ------------------------------------------------------------------------------


def test_the_felt_stiffness_is_the_drive_in_series_with_a_cantilever():
    found = from_document(one_link(beam=tube(12, 1))).bending()
    _, bending_stiffness = section_of(0.012, 0.001)
    drive_at_tip = RATIO**2 * 40.0 / LENGTH**2
    assert found.rigid.static_stiffness == pytest.approx(drive_at_tip)
    compliance = 1.0 / drive_at_tip + LENGTH**3 / (3.0 * bending_stiffness)
    assert found.bent.static_stiffness == pytest.approx(1.0 / compliance)
    assert found.given
    assert (found.links, found.tubes, found.kept) == (("arm",), (), ())


def test_the_first_mode_of_a_beam_with_a_rotor_at_its_foot():
    """Behind a rigid drive: bending of a beam hinged at an inertia J, free at its tip (its own derivation).

    With w = cosh and cos pieces, w(0) = 0, EI w''(0) = -J omega^2 w'(0), w'' = w''' = 0 at L.
    """
    mass, stiffness = section_of(0.012, 0.001)
    J = RATIO**2 * ROTOR

    def determinant(x):
        """Of the four conditions on w = a sin + b cos + c sinh + d cosh of x s/L."""
        b = x / LENGTH
        share = J * stiffness * b**4 / mass  # J omega^2
        s, c, sh, ch = np.sin(x), np.cos(x), np.sinh(x), np.cosh(x)
        return np.linalg.det(
            [
                [0.0, 1.0, 0.0, 1.0],
                [share * b, -stiffness * b**2, share * b, stiffness * b**2],
                [-s, -c, sh, ch],
                [-c, s, ch, sh],
            ]
        )

    root = brentq(determinant, 1.0, 3.9)
    expected = (root / LENGTH) ** 2 * np.sqrt(stiffness / mass) / (2.0 * np.pi)
    found = from_document(one_link(None, beam=tube(12, 1))).bending()
    assert found.bent.first_mode == pytest.approx(expected, rel=1e-3)
    assert np.isnan(found.rigid.first_mode)
    assert found.rigid.static_stiffness == np.inf


def test_rigid_links_keep_mass_centre_and_inertia():
    """Built once more without beams; of links that are their beams alone with the numbers of the beam."""
    for document in (five_bar(), spatial_arm(), light_five_bar()):
        bent = from_document(document)
        rigid = with_rigid_links(bent)
        assert not rigid.mechanism.flexible
        for key in ("mass", "center_of_mass", "inertia"):
            own, kept = getattr(bent.mechanism.links, key), getattr(rigid.mechanism.links, key)
            np.testing.assert_allclose(kept, own, rtol=1e-9, atol=1e-15)
    plain = from_document(without_beams(five_bar())).at()
    found = from_document(five_bar()).bending()
    assert found.rigid.stiffness_max == pytest.approx(plain.chart(decay=False).stiffness_max)
    assert found.rigid.static_stiffness == pytest.approx(float(plain.effective.stiffness))
    assert found.rigid.first_mode == pytest.approx(natural_frequencies(plain.ungripped_plant)[2])


def test_softening_raises_or_lowers_the_largest_stiffness():
    """The direction is an outcome: both occur, of devices that differ in little else."""
    raised = from_document(five_bar()).bending()
    lowered = from_document(light_five_bar()).bending()
    for found in (raised, lowered):
        assert found.bent.static_stiffness < found.rigid.static_stiffness
    assert raised.bent.stiffness_max > raised.rigid.stiffness_max
    assert lowered.bent.stiffness_max < lowered.rigid.stiffness_max


def test_the_device_itself_is_the_bent_one():
    bent = from_document(with_beams(five_bar(), modes=1))
    found = bent.bending()
    assert found.bent.stiffness_max == bent.at().chart(decay=False).stiffness_max
    assert found.operating_point.name == bent.name


# --- typical tubes ----------------------------------------------------------------------------------


def test_a_tube_has_half_of_the_mass_and_the_diameter_that_follows():
    (size,) = from_document(one_link(**uniform(0.12))).bending().tubes
    mass, stiffness = section_of(size.outer_diameter, size.wall)
    assert (size.link, size.length, size.share) == ("arm", LENGTH, SHARE)
    assert size.wall == pytest.approx(WALL * size.outer_diameter)
    assert mass * LENGTH == pytest.approx(0.06)
    assert size.damping_time == 0.0  # the file's mode_ratio damps bending as well
    undamped = one_link(**uniform(0.12))
    del undamped["mechanism"]["damping"]
    (size,) = from_document(undamped).bending().tubes
    frequency = FIRST_ROOT**2 / LENGTH**2 * np.sqrt(stiffness / mass)
    assert size.damping_time == pytest.approx(2.0 * DAMPING / frequency)


def test_a_tube_bends_as_the_beam_of_its_size():
    """The same device with the tube written into its file, of more modes: two are enough."""
    document = one_link(**uniform(0.12))
    found = from_document(document).bending()
    (size,) = found.tubes
    written = copy.deepcopy(document)
    written["mechanism"]["links"][0]["beam"] = tube(1e3 * size.outer_diameter, 1e3 * size.wall, modes=5)
    again = from_document(written).bending()
    assert not found.given
    assert again.given
    assert found.rigid.stiffness_max == pytest.approx(again.rigid.stiffness_max)
    assert found.bent.static_stiffness == pytest.approx(again.bent.static_stiffness)
    assert found.bent.first_mode == pytest.approx(again.bent.first_mode, rel=5e-5)
    assert found.bent.stiffness_max == pytest.approx(again.bent.stiffness_max, rel=5e-4)


def test_a_heavy_link_is_a_thinner_tube_and_one_without_room_stays_rigid():
    """Its share is halved until it fits: not thicker than a quarter of its length."""
    (thin,) = from_document(one_link(**uniform(6.0))).bending().tubes
    assert LEAST_SHARE <= thin.share < SHARE
    assert thin.outer_diameter / LENGTH <= THICKEST < np.sqrt(2.0) * thin.outer_diameter / LENGTH
    (lean,) = from_document(one_link(**uniform(0.12, inertia_kg_m2=3e-4))).bending().tubes
    assert lean.share < SHARE  # a heavy hub beside a light rod
    assert from_document(one_link(**uniform(300.0))).bending() is None


def test_links_without_room_are_named():
    found = zwidth.load("phantom-premium-1.5").bending()
    assert found.links == ("upper-arm", "forearm", "rod")
    assert found.kept == ("crank",)  # 191 g on 33 mm
    assert [size.share for size in found.tubes] == [1.0 / 16.0, 0.5, 0.5]


def test_legs_are_named_as_they_are_written():
    found = template("delta").bending()
    assert found.links == ("arm",)
    assert "arm-1" in from_document(template("delta").document).mechanism.links.names
    assert found.kept
    assert not {name[:-2] for name in found.links + found.kept} & {"arm", "rod"}


@pytest.mark.parametrize(
    ("name", "question"),
    [
        ("published-two-mass", {}),  # a plant
        ("openwrist", {}),  # no lengths
        ("novint-falcon", {}),  # no masses
        ("five-bar", {"model": "rigid"}),
    ],
)
def test_where_nothing_could_bend(name, question):
    asked = zwidth.load(name)
    assert asked.bending(asked.at(**question)) is None


# --- where it is asked ------------------------------------------------------------------------------


def test_the_hand_and_the_load_are_on_both():
    """Asked at a point, or of the device: the same; whoever holds the handle holds both."""
    paddle = template("paddle")
    free, held = paddle.bending(), paddle.bending(paddle.at(operator="thesis-arm"))
    own = paddle.held_by("thesis-arm").bending()
    assert held.bent.stiffness_max == own.bent.stiffness_max
    assert held.bent.stiffness_max > 1.5 * free.bent.stiffness_max
    assert held.bent.static_stiffness == free.bent.static_stiffness
    arm = template("serial-2r")
    pushed = arm.bending(arm.at(load=(0.0, -3.0)))
    loaded = arm.under((0.0, -3.0)).bending()
    for one in ("bent", "rigid"):
        assert getattr(pushed, one).stiffness_max == pytest.approx(getattr(loaded, one).stiffness_max)
        assert getattr(pushed, one).stiffness_max != pytest.approx(getattr(arm.bending(), one).stiffness_max, 1e-6)


def test_a_link_that_buckles_has_a_reason():
    """Rigid under a load that its tube does not bear."""
    column = {"mass_kg": 2e-3, "center_of_mass_m": [LENGTH / 2.0], "inertia_kg_m2": [1e-9, 1.5e-5, 1.5e-5]}
    document = device(
        [link("pusher", "base", "prismatic", axis=[1.0, 0.0, 0.0], length_m=LENGTH, **column)],
        [drive("pusher", transmission_ratio=150.0)],
        {"pusher": 0.02},
        (1.0, 0.0, 0.0),
    )
    pusher = from_document(document)
    found = pusher.bending(pusher.at(load=(-500.0, 0.0, 0.0)))
    assert found.bent.reason.startswith("no equilibrium: ")
    assert np.isnan([found.bent.stiffness_max, found.bent.static_stiffness, found.bent.first_mode]).all()
    assert found.rigid.stiffness_max > 0.0
    assert not pusher.bending().bent.reason


def test_no_wall_is_stable_or_no_period_is_known():
    undamped = five_bar() | {"loop": {"sampling_period_s": 0.00125, "delay_samples": 2.0}}
    undamped["mechanism"]["damping"] = {"mode_ratio": 0.0}
    found = from_document(undamped).bending()
    assert found.bent.reason == found.rigid.reason
    assert found.bent.reason.endswith(" is stable")
    assert np.isnan(found.bent.stiffness_max)
    document = copy.deepcopy(zwidth.load("five-bar").document)
    del document["loop"]["sampling_period_s"]
    with pytest.raises(MissingNumbersError, match="sampling_period_s"):
        from_document(document).bending()


def test_one_point_and_one_direction_are_asked_for():
    arms = zwidth.load("five-bar")
    for question in ({"directions": [(1.0, 0.0), (0.0, 1.0)]}, {"position": [(0.0, 0.25), (0.0, 0.2)]}):
        with pytest.raises(OperatingPointError):
            arms.bending(arms.at(**question))
    with pytest.raises(TypeError, match="device"):
        zwidth.study.bending("five-bar")


def test_the_document_and_the_table_have_the_same_numbers():
    found = template("serial-2r").bending()
    document, columns = found.document(), found.table()
    for key in ("stiffness_max_N_per_m", "static_stiffness_N_per_m", "first_mode_Hz"):
        assert columns[key] == [document["rigid"][key], document["bent"][key]]
    assert [size["link"] for size in document["tubes"]] == document["links"] == ["upper", "lower"]
    assert "2 links" in repr(found)
    assert "reason" not in document["bent"]
