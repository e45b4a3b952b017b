"""Ratios that change with the joint: against a constant ratio, and against a linkage that has one."""

from __future__ import annotations

import copy
import tomllib

import numpy as np
import pytest

from tests.device.device_cases import ARM_FILE
from zwidth.device import from_document
from zwidth.errors import ArgumentError
from zwidth.model import OK, RatioTable, effective_parameters, modes_in_general, natural_frequencies

MEASURES = ("stiffness_max", "damping_max", "motor_side_mass", "rigid_mass", "stiffness", "peak_force")
GRID = np.stack(np.meshgrid(np.linspace(0.05, 0.35, 5), np.linspace(-0.15, 0.3, 4)), axis=-1)

# Keys that make the two-link arm one of the general mechanisms, whose modes are computed in another way.
GENERAL = {
    "plain": {},
    "joint spring": {"links": {"joint_stiffness_Nm_per_rad": 0.05}},
    "joint damper": {"links": {"joint_damping_Nms_per_rad": 1e-4}},
    "turning rotor": {"drives": {"motor_link": "upper", "motor_axis": [0.0, 0.0, 1.0]}},
}


def two_links(ratio, kind="plain", flexible=True):
    """Two links with a ratio at either drive: a number, or a table."""
    document = tomllib.loads(ARM_FILE)
    mechanism = document["mechanism"]
    if not flexible:
        mechanism.pop("damping")
    for drive in mechanism["drives"]:
        del drive["transmission_ratio"]
        drive.pop("stiffness_Nm_per_rad", None)
        drive |= {"torque_limit_Nm": 0.1, "encoder_counts_per_rev": 4000, "coulomb_Nm": 1e-3}
        drive |= {"stiffness_Nm_per_rad": 0.5} if flexible else {}
        drive["ratio_table" if isinstance(ratio, dict) else "transmission_ratio"] = copy.deepcopy(ratio)
    mechanism["links"][1] |= GENERAL[kind].get("links", {})
    mechanism["drives"][1] |= GENERAL[kind].get("drives", {})
    return from_document(document)


CONSTANT = {"joint_rad": [-3.0, -1.0, 0.3, 3.0], "ratio": [10.0] * 4}
CHANGING = {"joint_rad": [-1.0, 0.0, 0.5, 2.0, 2.5], "ratio": [8.0, 10.0, 11.0, 15.0, 14.0]}


@pytest.mark.parametrize("kind", GENERAL)
def test_a_constant_table_is_the_number(kind):
    table, number = two_links(CONSTANT, kind), two_links(10.0, kind)
    for direction in ((1.0, 0.0), (0.3, -0.7)):
        one, other = (device.at((0.15, 0.2), direction).plant for device in (table, number))
        for name in ("mass", "damping", "stiffness", "actuator", "sensor"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name
        assert one.nonlinear.force_limit == other.nonlinear.force_limit
        assert [c.step for c in one.nonlinear.counters] == [c.step for c in other.nonlinear.counters]
        assert [f.coulomb for f in one.nonlinear.friction] == [f.coulomb for f in other.nonlinear.friction]
    for name in (*MEASURES, "position_resolution", "friction_force"):
        values = [device.at(GRID).measure(name).values for device in (table, number)]
        assert np.array_equal(*values, equal_nan=True), name


@pytest.mark.parametrize("kind", GENERAL)
@pytest.mark.parametrize("flexible", [True, False])
def test_a_map_has_the_numbers_of_its_points(kind, flexible):
    device = two_links(CHANGING, kind, flexible)
    many = device.at(GRID)
    assert {int(status) for status in np.unique(many.status)} > {OK}  # some are outside of the table
    for name in MEASURES:
        if (name == "stiffness" and not flexible) or (
            kind == "joint damper" and name in ("stiffness_max", "damping_max")
        ):
            continue  # infinite; no wall is stable
        together = many.measure(name).values
        alone = np.full(many.shape, np.nan)
        for index in zip(*np.nonzero(many.status == OK), strict=True):
            alone[index] = device.at(GRID[index]).measure(name).values
        assert np.isfinite(alone).sum() > 5, name
        assert together == pytest.approx(alone, rel=1e-8, nan_ok=True), name
    assert many.drives.transmission[many.status == OK].std() > 1.0


def test_each_posture_is_the_device_with_its_ratio():
    """The two drives have different ratios at each place, and the chart is that of these numbers."""
    device = two_links(CHANGING)
    for place in ((0.2, 0.2), (0.3, 0.05), (0.1, 0.25)):
        point = device.at(place)
        settings = {f"drives.{n}.transmission_ratio": float(r) for n, r in zip(*_ratios(point), strict=True)}
        constant = device.with_(settings).at(place)
        assert np.array_equal(point.plant.stiffness, constant.plant.stiffness)
        assert point.chart(decay=False).stiffness_max == constant.chart(decay=False).stiffness_max
        assert np.array_equal(point.whole_mass_matrix, constant.whole_mass_matrix)


def _ratios(point):
    return point.drives.names, point.drives.transmission


def test_several_directions_have_the_ratio_too():
    device = two_links(CHANGING)
    point = device.at((0.25, 0.1), directions=[(1, 0), (0, 1)])
    settings = {f"drives.{n}.transmission_ratio": float(r) for n, r in zip(*_ratios(point), strict=True)}
    constant = device.with_(settings).at((0.25, 0.1), directions=[(1, 0), (0, 1)])
    for model in ("full", "two-mass", "rigid"):
        one, other = (each.in_model(model).plant_of_directions for each in (point, constant))
        assert np.array_equal(one.mass, other.mass), model
        assert np.array_equal(one.stiffness, other.stiffness), model


def test_the_functions_of_the_model_look_the_ratio_up():
    device = two_links(CHANGING)
    point = device.at((0.25, 0.1))
    numbers = effective_parameters(device.mechanism, point.posture, [1.0, 0.0, 0.0])
    assert numbers.motor_side_mass == point.effective.motor_side_mass > 0.0


def test_the_large_motion_refuses_a_table():
    with pytest.raises(ArgumentError, match=r"simulated .* ratio"):
        two_links(CHANGING).at().move()


def test_what_a_linear_answer_leaves_out_does_not_hang_on_the_table():
    assert two_links(CHANGING).linear_omissions == two_links(10.0).linear_omissions != ()


def test_a_sliding_joint_has_its_ratio_in_radians_per_metre():
    document = tomllib.loads(SLIDER_FILE)
    device = from_document(document)
    n = 100.0 + 50.0 * 0.02
    assert device.at((0.02, 0.0)).drives.transmission == pytest.approx([n], rel=1e-12)
    assert device.at((0.02, 0.0)).effective.rigid_mass == pytest.approx(0.2 + n**2 * 1e-6, rel=1e-12)


def test_a_turn_more_is_the_same_posture():
    table = RatioTable(np.array([3.0, 4.0]), np.array([1.0, 2.0]), turns=True)
    assert table.at(np.array([3.5, 3.5 - 2 * np.pi, -3.0])) == pytest.approx([1.5, 1.5, 0.2832 + 1.0], abs=1e-3)
    sliding = RatioTable(np.array([3.0, 4.0]), np.array([1.0, 2.0]), turns=False)
    assert np.isnan(sliding.at(np.array([3.5 - 2 * np.pi, np.nan, 4.001]))).all()


# --- a linkage ----------------------------------------------------------------------------------------------
#
# A motor's crank of length CRANK at the origin turns an arm about (BASE, 0) by a coupler of length COUPLER, which
# the arm holds at ROCKER from its joint. The coupler's length gives psi(q), crank angle over arm angle, and
#
#     dpsi/dq = (A - B) . B' / (A - B) . A',    A = CRANK (cos psi, sin psi), B = (BASE, 0) + ROCKER (cos q, sin q)

CRANK, COUPLER, ROCKER, BASE = 0.05, 0.1, 0.06, 0.1
ARM, RATIO = 0.12, 8.0
ANGLES = (0.92, 1.0, 1.2345, 1.5, 1.65)

SLIDER_FILE = """
name = "a slide"
[[mechanism.links]]
name = "carriage"
joint = "prismatic"
axis = [1, 0, 0]
mass_kg = 0.2
inertia_kg_m2 = 0
[mechanism.handle]
link = "carriage"
[mechanism.assemblies.only]
joints_m = { carriage = 0.0 }
[mechanism.reference]
position_m = [0, 0]
direction = [1, 0]
[[mechanism.drives]]
name = "motor"
joint = "carriage"
motor_inertia_kg_m2 = 1e-6
ratio_table = { joint_m = [-0.1, 0.0, 0.1], ratio = [95, 100, 105] }
[loop]
sampling_period_s = 0.001
"""

ARM_LINK = f"""
[[mechanism.links]]
name = "arm"
joint = "revolute"
origin_m = [{BASE}, 0, 0]
length_m = {ARM}
mass_kg = 0.06
center_of_mass_m = [0.06]
inertia_kg_m2 = 1e-4
"""
REST = """
[mechanism.handle]
link = "arm"
[mechanism.damping]
mode_ratio = 0.05
[loop]
sampling_period_s = 0.001
delay_samples = 0.5
"""
DRIVE = {"motor_inertia_kg_m2": 1.5e-6, "stiffness_Nm_per_rad": 0.4, "torque_limit_Nm": 0.1}
DRIVE |= {"name": "motor", "encoder_counts_per_rev": 4000}


def crank_angle(q):
    """psi(q) with the crank beside the arm: the law of cosines in the triangle of the origin, A and B."""
    x, y = BASE + ROCKER * np.cos(q), ROCKER * np.sin(q)
    r = np.hypot(x, y)
    return np.arctan2(y, x) + np.arccos((r**2 + CRANK**2 - COUPLER**2) / (2.0 * r * CRANK))


def crank_turns(q):
    """dpsi/dq"""
    psi = crank_angle(q)
    between = np.array([CRANK * np.cos(psi) - BASE - ROCKER * np.cos(q), CRANK * np.sin(psi) - ROCKER * np.sin(q)])
    B = ROCKER * np.array([-np.sin(q), np.cos(q)])
    A = CRANK * np.array([-np.sin(psi), np.cos(psi)])
    return (between * B).sum(axis=0) / (between * A).sum(axis=0)


def handle(q):
    return BASE + ARM * np.cos(q), ARM * np.sin(q)


def linkage():
    """The motor on the crank, of a constant ratio; crank and coupler have no mass."""
    links = f"""
name = "four bar"
[[mechanism.links]]
name = "crank"
joint = "revolute"
length_m = {CRANK}
mass_kg = 0
inertia_kg_m2 = 0
[[mechanism.links]]
name = "coupler"
parent = "crank"
joint = "revolute"
length_m = {COUPLER}
mass_kg = 0
inertia_kg_m2 = 0
[[mechanism.loops]]
name = "joint"
links = ["coupler", "arm"]
points_m = [[{COUPLER}, 0, 0], [{ROCKER}, 0, 0]]
"""
    document = tomllib.loads(links + ARM_LINK + REST)
    q = 1.2
    psi = float(crank_angle(q))
    towards = np.arctan2(ROCKER * np.sin(q) - CRANK * np.sin(psi), BASE + ROCKER * np.cos(q) - CRANK * np.cos(psi))
    angles = {"crank": psi, "coupler": float(towards) - psi, "arm": q}
    return _completed(document, q, angles, {"joint": "crank", "transmission_ratio": RATIO})


def tabulated(entries):
    """The arm alone, driven through the ratio that the linkage has."""
    q = np.linspace(0.85, 1.75, entries)
    table = {"joint_rad": q.tolist(), "ratio": (RATIO * crank_turns(q)).tolist()}
    document = tomllib.loads('name = "arm"' + ARM_LINK + REST)
    return _completed(document, 1.2, {"arm": 1.2}, {"joint": "arm", "ratio_table": table})


def _completed(document, q, angles, drive):
    document["mechanism"]["assemblies"] = {"only": {"joints_rad": angles}}
    document["mechanism"]["reference"] = {
        "position_m": list(handle(q)),
        "direction": [-float(np.sin(q)), float(np.cos(q))],
    }
    document["mechanism"]["drives"] = [DRIVE | drive]
    return from_document(document)


def numbers_at(device, q):
    """Masses, stiffness, natural frequencies, largest stiffness, force and resolution, the arm at an angle."""
    point = device.at(handle(q), (-np.sin(q), np.cos(q)))
    felt = point.effective
    return np.array(
        [
            felt.link_side_mass,
            felt.motor_side_mass,
            felt.rigid_mass,
            felt.stiffness,
            natural_frequencies(point.plant)[-1],
            point.chart(decay=False).stiffness_max,
            point.measure("peak_force").values,
            point.measure("position_resolution").values,
        ]
    )


def test_a_table_of_a_linkage_is_the_linkage():
    bars, coarse, fine = linkage(), tabulated(27), tabulated(401)
    assert np.ptp(RATIO * crank_turns(np.array(ANGLES))) > 2.0  # the ratio does change
    errors = []
    for q in ANGLES:
        exact = numbers_at(bars, q)
        assert numbers_at(fine, q) == pytest.approx(exact, rel=1e-6)
        errors.append([np.abs(numbers_at(each, q) / exact - 1.0).max() for each in (coarse, fine)])
    assert (
        np.max(errors, axis=0)[1] < np.max(errors, axis=0)[0] / 30.0
    )  # what is left is the interpolation's error


def test_the_linkage_of_this_file_moves_as_its_formulas_say():
    bars = linkage()
    for q in ANGLES:
        posture = bars.at(handle(q)).posture
        names = bars.mechanism.links.names
        turned = dict(zip(names, posture.angles.tolist(), strict=True))
        assert turned["arm"] == pytest.approx(q, abs=1e-9)
        assert turned["crank"] == pytest.approx(float(crank_angle(q)), abs=1e-9)
        assert np.linalg.norm(posture.jacobian) == pytest.approx(ARM / float(crank_turns(q)), rel=1e-9)


@pytest.mark.parametrize("kind", ["joint spring", "turning rotor"])
def test_the_modes_of_many_postures_are_those_of_each(kind):
    """Those of a mechanism that is not plain are put together for all postures at once."""
    device = two_links(CHANGING, kind)
    many = device.at(GRID)
    modes = modes_in_general(many.mechanism, many.posture, many.direction, many.damping, many.encoders)
    found = np.sort(np.sqrt(np.abs(modes.frequency_squared)).reshape(*many.shape, -1), axis=-1)
    for index in zip(*np.nonzero(many.status == OK), strict=True):
        alone = 2.0 * np.pi * natural_frequencies(device.at(GRID[index]).plant)
        assert found[index][-2:] == pytest.approx(np.sort(alone)[-2:], rel=1e-10)
    assert np.isnan(modes.input.reshape(*many.shape, -1)[many.status != OK]).all()
