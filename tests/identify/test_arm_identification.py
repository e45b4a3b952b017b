"""A mechanism's parameters from virtual benches whose equations are not those of the fit."""

from copy import deepcopy
from dataclasses import replace
from itertools import chain as joined

import numpy as np
import pytest

from tests.identify.arm_benches import chain_device, five_bar_columns, five_bar_device, random_five_bar
from tests.identify.arm_truth import chain_results, five_bar_results, held, link_parameters, one_chain, true_values
from zwidth.device import from_document
from zwidth.errors import DeviceError
from zwidth.identify import Parameters, base_parameters, check_sampling, identify_arm, record_of
from zwidth.identify.arm import COLUMNS
from zwidth.identify.arm.checks import drive_channels_of
from zwidth.identify.arm.smoothing import choose_band
from zwidth.identify.arm.stretches import TorqueTiming, smoothed

SEEDS = 1000


def identified(device, columns, **options):
    return identify_arm(device, [record_of(columns, COLUMNS)], **options)


def check(result, what):
    """The check of this name that failed, or the last of this name."""
    named = [one for one in result.checks if one.what == what]
    return next((one for one in named if not one.passed), named[-1] if named else None)


def mass_of(device, which):
    """An effective mass at the device's reference [kg]."""
    return float(device.at().measure(which))


@pytest.fixture(scope="module")
def chain():
    return one_chain()


@pytest.fixture(scope="module")
def result(chain):
    return identified(chain_device(chain[0], 0, wrong=1.3), chain[1])


def test_what_is_left_of_the_torque_is_named_only_where_it_follows_a_cause(chain, result):
    assert check(result, "remainder") is None
    columns = dict(chain[1])
    drift = np.linspace(0.0, 0.5 * np.std(columns["torque_Nm.link-2"]), len(columns["time_s"]))
    columns["torque_Nm.link-2"] = columns["torque_Nm.link-2"] + drift
    remainder = check(identified(chain_device(chain[0], 0, wrong=1.3), columns), "remainder")
    assert remainder.warning
    assert "of motor-2 goes" in remainder.reason
    assert "motor-1" not in remainder.reason


# --- numbers ------------------------------------------------------------------------------------------------


def test_a_few_arms_are_known_within_their_intervals():
    shares = [list(held(*one).values()) for one in chain_results(2, 1, 7)]
    shares += [list(held(*one).values()) for one in five_bar_results(1, 7)]
    every = np.concatenate(shares)
    assert len(every) > 25
    assert np.mean(every) > 0.8


def test_an_arm_without_noise_is_known_to_a_ten_thousandth(chain):
    chains, columns, device = one_chain(counts=10**11, noise=0.0)
    truth = true_values(device, chains.coulomb[0], chains.viscous[0], np.zeros(3))
    found = identified(device, columns)
    for name, value in truth.items():
        if "delay" not in name and "offset" not in name:
            assert found[name].value == pytest.approx(value, rel=2e-4, abs=1e-6), name
    assert found.validation > 1.0 - 1e-6


def test_intervals_widen_with_noise(chain, result):
    noisy = identified(chain[2], one_chain(noise=0.1)[1])
    quiet, loud = result["rigid mass along (0.6, 0.8, 0)"], noisy["rigid mass along (0.6, 0.8, 0)"]
    assert loud.high - loud.low > 3.0 * (quiet.high - quiet.low)


def test_what_the_torques_do_not_tell_is_open_unless_rotors_are_known(chain, result):
    side = result["link side mass along (0.6, 0.8, 0)"]
    assert (side.low, side.high) == (0.0, np.inf)
    known = identified(chain[2], chain[1], rotors="known")
    mass = known["link side mass along (0.6, 0.8, 0)"]
    assert 0.0 < mass.low < mass.value < mass.high < np.inf
    assert mass.value == pytest.approx(mass_of(chain[2], "link_side_mass"), rel=0.02)


def test_the_links_for_the_file_make_the_same_base_parameters_and_can_exist(chain, result):
    device = chain_device(chain[0], 0, wrong=1.3).with_(result.numbers)
    mechanism = device.mechanism
    parameters = Parameters.of(mechanism, rotors=True)
    base = base_parameters(parameters, device.at().posture.angles, np.zeros(3))
    values = base.matrix @ link_parameters(mechanism, parameters)
    for name, value in zip(base.names, values, strict=True):
        if name[0] in "ImJ":
            one = result[name]
            assert abs(value - one.value) < 0.2 * (one.high - one.low), name
    assert np.all(mechanism.links.mass > 0.0)
    assert np.all(np.linalg.eigvalsh(mechanism.links.inertia)[:, -1] > 0.0)
    rigid = result["rigid mass along (0.6, 0.8, 0)"].value
    assert mass_of(device, "rigid_mass") == pytest.approx(rigid, rel=1e-3)


def test_the_unseen_part_is_predicted_and_drawn(result):
    from matplotlib.figure import Figure

    from zwidth.show.figures.identify import draw_arm

    assert result.validation > 0.99
    assert {"time_s", "measured_torque_Nm.motor-1", "predicted_torque_Nm.motor-2"} <= set(result.table())
    ax = Figure().subplots()
    draw_arm(ax, result)
    lines = [line for line in ax.get_lines() if len(line.get_xdata()) > 10]
    assert len(lines) == 4
    assert np.allclose(lines[0].get_ydata(), lines[1].get_ydata(), atol=0.2)


def test_the_last_of_several_records_is_not_fitted(chain):
    names = [name for name in chain[1] if name != "time_s"]
    one = record_of(chain[1], COLUMNS, "one")
    turned = dict(chain[1]) | {name: -chain[1][name] for name in names if name.startswith("torque")}
    both = identify_arm(chain[2], [one, record_of(turned, COLUMNS, "other")])
    assert "of motor-1 in " in check(both, "signs").reason
    same = identify_arm(chain[2], [one, record_of(chain[1], COLUMNS, "other")])
    assert "other" in same.validated_on
    assert same.validation > 0.99


def test_records_at_the_motors_and_at_the_joints_give_the_same(chain, result):
    columns = {}
    for name, values in chain[1].items():
        factor = 10.0 if name.startswith("angle") else 0.1 if name.startswith("torque") else 1.0
        columns[name.replace("link", "motor")] = factor * values
    other = identified(chain[2], columns, side="motor")
    assert other["m c_x(link-2)"].value == pytest.approx(result["m c_x(link-2)"].value, rel=1e-6)


def test_a_command_acts_after_the_delay_that_is_stated(chain, result):
    # half a sample of delay and half a period of hold: what is commanded now acts a period later
    columns = {name: values[1:] if name.startswith("torque") else values[:-1] for name, values in chain[1].items()}
    found = identified(chain[2], columns, torque="commanded")
    assert check(found, "timing").passed
    assert abs(found["further delay of the torques"].value) < 2e-4
    assert found["m c_x(link-2)"].value == pytest.approx(result["m c_x(link-2)"].value, rel=0.01)


def test_torques_that_do_not_act_when_they_are_recorded_are_told(chain):
    columns = {name: values[3:] if name.startswith("torque") else values[:-3] for name, values in chain[1].items()}
    told = check(identified(chain[2], columns), "timing")
    assert not told.passed
    assert "torques act 0.006 s" in told.reason
    assert "time stamps" in told.reason


@pytest.mark.slow
def test_intervals_hold_the_true_values_of_93_to_97_percent_of_1000_arms():
    """A fourth each: two links, three that stand upright, two that a computer drives, loops."""
    count = SEEDS // 4
    benches = (
        chain_results(2, count, 1),
        chain_results(3, count, 2, 9.81, duration=40.0),
        chain_results(2, count, 3, bench="driven", counts=40_000, substeps=2),
        five_bar_results(count, 4),
    )
    masses, others = [], []
    for found, truth in joined.from_iterable(benches):
        for name, value in held(found, truth).items():
            (masses if name.startswith("rigid mass") else others).append(value)
    assert len(masses) == SEEDS
    assert 0.93 <= np.mean(masses) <= 0.97
    assert 0.93 <= np.mean(others) <= 0.97


# --- records that are not as they should be -------------------------------------------------------------------


def test_columns_are_asked_for_by_name(chain):
    columns = {name: values for name, values in chain[1].items() if name != "torque_Nm.link-2"}
    with pytest.raises(DeviceError, match=r"torque_Nm.link-2 \(or torque_Nm.motor-2, .* missing"):
        identified(chain[2], columns)
    degrees = {name.replace("angle_rad", "angle_deg"): values for name, values in chain[1].items()}
    with pytest.raises(DeviceError, match=r"pi/180 .* angle_rad\.link-1"):
        identified(chain[2], degrees)
    twice = chain[1] | {"torque_Nm.motor-2": chain[1]["torque_Nm.link-2"]}
    with pytest.raises(DeviceError, match="same drive"):
        identified(chain[2], twice)


def test_matlab_names_are_read(chain):
    columns = {name.replace(".", "_").replace("-", "_"): values for name, values in chain[1].items()}
    assert identified(chain[2], columns).validation > 0.99


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [("side", "hip", "joint, motor"), ("torque", "felt", "measured, commanded"), ("rotors", "x", "fitted, known")],
)
def test_options_are_checked(chain, option, value, words):
    with pytest.raises(DeviceError, match=words):
        identified(chain[2], chain[1], **{option: value})
    with pytest.raises(DeviceError, match="finite numbers"):
        identified(chain[2], chain[1], gravity=[1.0])


@pytest.mark.parametrize(
    ("what", "change", "words"),
    [
        ("motion", {"angle_rad.link-1": lambda q: 180 / np.pi * q}, "degrees or"),
        ("torque", {"torque_Nm.link-1": lambda u: 0.0 * u + 0.2}, "constant"),
        ("signs", {"torque_Nm.link-1": lambda u: -u}, "motor-1"),
        ("sampling", {"time_s": lambda t: t[::-1]}, "sort"),
    ],
)
def test_a_wrong_column_is_refused_with_the_reason(chain, what, change, words):
    columns = {name: change[name](values) if name in change else values for name, values in chain[1].items()}
    found = identified(chain[2], columns)
    assert not check(found, what).passed
    assert words in check(found, what).reason
    assert not found.estimates
    assert words in found.reason


def test_swapped_torques_are_told(chain):
    columns = dict(chain[1])
    columns |= {"torque_Nm.link-1": chain[1]["torque_Nm.link-2"], "torque_Nm.link-2": chain[1]["torque_Nm.link-1"]}
    found = identified(chain[2], columns)
    assert "motor-1 and motor-2 are" in check(found, "signs").reason
    assert "tell which" in check(found, "signs").reason


@pytest.mark.parametrize(
    ("factor", "other", "words"),
    [
        (180 / np.pi, "link-1", "in degrees"),
        (-1.0, "link-1", "other sign"),
        (1.0, "link-2", "columns swapped?"),
    ],
)
def test_velocities_that_are_not_the_derivative_are_told(chain, factor, other, words):
    rate = factor * np.gradient(chain[1][f"angle_rad.{other}"], chain[1]["time_s"])
    found = identified(chain[2], chain[1] | {"velocity_rad_per_s.link-1": rate})
    assert words in check(found, "velocity").reason
    assert not found.estimates


def test_a_joint_at_rest_is_told_and_what_it_leaves_open_is_open(chain):
    columns = chain[1] | {"angle_rad.link-2": 1.2 + 0.0 * chain[1]["time_s"]}
    found = identified(chain[2], columns)
    assert check(found, "motion").warning
    assert "motor-2" in check(found, "motion").reason


def test_gravity_that_is_not_stated_is_told():
    _, columns, device = one_chain(seed=4, gravity=9.81)
    found = identified(device, columns)
    assert "as gravity" in check(found, "gravity").reason
    stated = identified(device, columns, gravity=(0.0, -9.81))
    assert check(stated, "gravity") is None
    assert stated.validation > 0.99


def test_a_short_record_and_one_with_gaps(chain):
    short = {name: values[:700] for name, values in chain[1].items()}
    assert "record longer" in identified(chain[2], short).reason
    gap = {name: np.delete(values, slice(5000, 5040)) for name, values in chain[1].items()}
    found = identified(chain[2], gap)
    assert "40 samples missing" in check(found, "sampling").reason
    assert found.validation > 0.99


def test_saturated_torques_are_told(chain):
    torque = chain[1]["torque_Nm.link-1"]
    most = 0.4 * np.max(np.abs(torque))
    found = identified(chain[2], chain[1] | {"torque_Nm.link-1": np.clip(torque, -most, most)})
    assert "largest torque: motor-1" in check(found, "torque").reason


def test_angles_that_the_loops_do_not_allow_are_told():
    rng = np.random.default_rng(1)
    bar = random_five_bar(rng)
    columns = five_bar_columns(bar, rng)
    columns["angle_rad.upper-left"] += 0.8
    columns["angle_rad.upper-right"] -= 0.8
    shorter = replace(bar, length=bar.length * np.array([1.0, 0.75, 1.0, 0.75]))
    found = identified(five_bar_device(shorter), columns)
    assert "no posture" in check(found, "posture").reason


def test_devices_without_a_mechanism_are_refused(chain):
    plant = from_document({"name": "p", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001}}, "p")
    with pytest.raises(DeviceError, match=r"needs a \[mechanism\]"):
        identified(plant, chain[1])


def test_an_unknown_mass_in_the_file_is_no_obstacle(chain):
    document = deepcopy(chain[2].document)
    for link in document["mechanism"]["links"]:
        del link["mass_kg"], link["inertia_kg_m2"], link["center_of_mass_m"]
    for drive in document["mechanism"]["drives"]:
        del drive["motor_inertia_kg_m2"]
    bare = from_document(document, "bare")
    found = identified(bare, chain[1])
    truth = true_values(chain[2], chain[0].coulomb[0], chain[0].viscous[0], np.zeros(3))
    name = "rigid mass along (0.6, 0.8, 0)"
    assert found[name].value == pytest.approx(truth[name], rel=0.01)
    filled = bare.with_(found.numbers)
    assert mass_of(filled, "rigid_mass") == pytest.approx(truth[name], rel=0.01)


@pytest.mark.parametrize("period", [0.002, 0.0001])
def test_records_are_smoothed_in_pieces_as_at_once(period, monkeypatch):
    chains, columns, device = one_chain(period=period, duration=12.0, counts=80_000)
    columns = {name: np.delete(values, slice(40, 50)) for name, values in columns.items()}
    record = record_of(columns, COLUMNS)
    sampling = check_sampling(record)[0]
    channels = drive_channels_of(device, record, "joint")
    band = choose_band([channels.coordinates(columns)], [sampling])
    assert (band.coarse > 1) == (period < 0.001)
    whole = list(smoothed(record, 0, sampling, channels, band, TorqueTiming()))
    pieces = type(record).pieces
    monkeypatch.setattr(type(record), "pieces", lambda self, rows=0: pieces(self, 1777))
    parts = list(smoothed(record, 0, sampling, channels, band, TorqueTiming()))
    assert len(whole) == len(parts) == 1
    for name in ("time", "coordinates", "rates", "accelerations", "signs", "forces"):
        one, other = getattr(whole[0], name), getattr(parts[0], name)
        assert np.allclose(one, other, rtol=0.0, atol=1e-9 * np.max(np.abs(one))), name
    truth = true_values(device, chains.coulomb[0], chains.viscous[0], np.zeros(3))
    mass = identify_arm(device, [record])["rigid mass along (0.6, 0.8, 0)"]
    assert mass.value == pytest.approx(truth["rigid mass along (0.6, 0.8, 0)"], abs=mass.high - mass.low)
