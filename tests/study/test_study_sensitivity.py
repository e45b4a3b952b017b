"""What to change first: derivatives of the largest stiffness against closed forms and against differences."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.systems import random_loop
from zwidth.chart import Peak, Tracer, closed_rings, largest_stiffness, stability_chart
from zwidth.chart.arcs import MINUS, PAIR, PLUS
from zwidth.device import address, from_document
from zwidth.device.load import device_of_point, load
from zwidth.errors import ChartError
from zwidth.loop import Loop
from zwidth.model import Plant
from zwidth.study import optimum, sensitivities
from zwidth.study.sensitivity.changed_devices import central_derivative, one_sided_derivative
from zwidth.study.sensitivity.optimum import second_peak_stiffness

LATE = "loop.delay_samples=1"
FILTER = "loop.velocity.filter={type='butterworth', order=2, cutoff_Hz=20.0}"


def one_mass(mass=0.1, damping=0.0, stiffness=0.0, **loop):
    plant = {"mass_kg": mass, "damping_Ns_per_m": damping, "stiffness_N_per_m": stiffness}
    return from_document({"name": "one", "plant": plant, "loop": {"sampling_period_s": 0.001, **loop}})


def logarithmic(device):
    return {number.path: number.logarithmic for number in sensitivities(device).numbers}


@cache
def sensitivities_of(name, *settings):
    return sensitivities(load(name, settings))


def largest(device):
    peak = largest_stiffness(device.at().loop)
    return peak.stiffness


def finite_difference(device, path, step):
    """The same by the whole search for the largest stiffness, at two steps with one extrapolation."""
    value = address.get(device.document, path)

    def K(share):
        return largest(from_document(address.assign(device.document, path, value * (1.0 + share))))

    coarse, fine = ((np.log(K(h)) - np.log(K(-h))) / (2.0 * h) for h in (step, step / 2.0))
    return (4.0 * fine - coarse) / 3.0


def test_the_undamped_rigid_wall_grows_as_m_over_t_squared():
    found = logarithmic(one_mass())
    assert found["plant.mass_kg"] == pytest.approx(1.0, abs=1e-10)
    assert found["loop.sampling_period_s"] == pytest.approx(-2.0, abs=1e-10)


def test_without_virtual_damping_the_closed_form_of_the_damped_wall_is_differentiated():
    """A 20 Hz filter makes B = 0 the best: K = b (1 - E)/((m/b)(1 - E) - T E), E = exp(-b T/m)."""
    device = load("hapkit-course", [FILTER])
    found = sensitivities(device)
    assert found.kind == "edge at B = 0"
    m, b, T = 0.03, 1.0, 0.001

    def K(m, b, T):
        E = np.exp(-b * T / m)
        return b * (1.0 - E) / ((m / b) * (1.0 - E) - T * E)

    assert found.peak.stiffness == pytest.approx(K(m, b, T), rel=1e-9)
    h = 1e-5
    exact = {
        "plant.mass_kg": np.log(K(m * (1 + h), b, T) / K(m * (1 - h), b, T)) / (2 * h),
        "plant.damping_Ns_per_m": np.log(K(m, b * (1 + h), T) / K(m, b * (1 - h), T)) / (2 * h),
        "loop.velocity.filter.cutoff_Hz": 0.0,
    }
    ours = {number.path: number.logarithmic for number in found.numbers}
    for path, value in exact.items():
        assert ours[path] == pytest.approx(value, abs=1e-7)


def test_one_sample_of_delay_on_a_free_mass_scales_alike_at_its_corner():
    found = logarithmic(one_mass(delay_samples=1.0))
    assert found["plant.mass_kg"] == pytest.approx(1.0, abs=1e-9)
    assert found["loop.sampling_period_s"] == pytest.approx(-2.0, abs=1e-9)


DEVICES = [
    ("published-two-mass", (), "smooth maximum"),
    ("published-two-mass", (LATE,), "corner"),
    ("published-two-mass", ("loop.delay_s=0.0005",), "corner"),
    ("hapkit-course", (), "smooth maximum"),
    ("hapkit-course", (FILTER,), "edge at B = 0"),
    ("five-bar", (), "smooth maximum"),
    ("five-bar", (LATE,), "corner"),
]


@pytest.mark.parametrize(("name", "settings", "kind"), DEVICES)
def test_mass_and_time_have_units(name, settings, kind):
    """K is kg/s^2: scaling all kilograms scales it by as much, scaling all seconds by the inverse square."""
    device, found = load(name, settings), sensitivities_of(name, *settings)
    assert found.kind == kind
    of = {n.path: n.logarithmic for n in found.numbers} | {g.path: g.logarithmic for g in found.groups}
    if device.mechanism is not None:
        kilograms = [f"mechanism.links.*.{key}" for key in ("mass_kg", "inertia_kg_m2")]
        kilograms += [f"mechanism.drives.*.{key}" for key in ("motor_inertia_kg_m2", "stiffness_Nm_per_rad")]
        seconds = {"mechanism.drives.*.stiffness_Nm_per_rad": -2.0}
    else:
        kilograms = [f"plant.{key}" for key in ("mass_kg", "damping_Ns_per_m", "stiffness_N_per_m")]
        seconds = {"plant.damping_Ns_per_m": -1.0, "plant.stiffness_N_per_m": -2.0}
    seconds |= {"loop.sampling_period_s": 1.0, "loop.delay_s": 1.0, "loop.velocity.filter.cutoff_Hz": -1.0}
    assert sum(of.get(path, 0.0) for path in kilograms) == pytest.approx(1.0, abs=2e-9)
    assert sum(weight * of.get(path, 0.0) for path, weight in seconds.items()) == pytest.approx(-2.0, abs=2e-9)


@pytest.mark.parametrize(
    ("name", "settings", "path"),
    [
        ("published-two-mass", (), "plant.mass_kg.1.1"),
        ("published-two-mass", (), "loop.sampling_period_s"),
        ("published-two-mass", (LATE,), "plant.mass_kg.0.0"),
        ("published-two-mass", ("loop.delay_s=0.0005",), "loop.delay_s"),
        ("published-two-mass", (FILTER,), "loop.velocity.filter.cutoff_Hz"),
        ("five-bar", (), "mechanism.links.upper-left.length_m"),
        ("five-bar", (LATE,), "mechanism.drives.motor-left.transmission_ratio"),
    ],
)
def test_the_whole_search_differenced_agrees(name, settings, path):
    device = load(name, settings)
    found = {number.path: number.logarithmic for number in sensitivities_of(name, *settings).numbers}[path]
    for step in (2e-3,) if device.mechanism else (2e-3, 1e-3):
        assert found == pytest.approx(finite_difference(device, path, step), abs=3e-6)


def scaled_plant(loop, what, factor):
    plant, T = loop.plant, loop.controller
    parts = {"mass": plant.mass, "damping": plant.damping, "stiffness": plant.stiffness}
    parts[what] = factor * parts[what]
    return Loop(Plant(**parts, actuator=plant.actuator, sensor=plant.sensor), T)


def change_over_factor(loop, held, what):
    return lambda factor: held.stiffness_to_first_order(scaled_plant(loop, what, factor))


@pytest.mark.parametrize("seed", range(4))
def test_random_loops_move_as_their_whole_search_says(seed):
    """Delays, filters, modes beyond Nyquist; every kind of optimum turns up."""
    rng = np.random.default_rng([5, seed])
    tried = 0
    while tried < 12:
        loop = random_loop(rng, ratios=(0.05, 0.3, 1.0))
        try:
            peak = largest_stiffness(loop)
        except ChartError:
            continue
        if peak is None or second_peak_stiffness(stability_chart(loop, decay=False)) > 0.99 * peak.stiffness:
            continue
        tried += 1
        held = optimum(loop, peak)
        assert held.stiffness_to_first_order(loop) == pytest.approx(peak.stiffness, rel=1e-9)
        for what in ("mass", "damping", "stiffness"):
            slope = central_derivative(change_over_factor(loop, held, what), 1.0, 1.0)
            h = 1e-4
            peaks = [largest_stiffness(scaled_plant(loop, what, 1.0 + sign * h)).stiffness for sign in (1, -1)]
            assert slope.value == pytest.approx((peaks[0] - peaks[1]) / (2 * h), abs=2e-5 * peak.stiffness)


@pytest.mark.parametrize(("damping", "kind"), [(5.0, "edge at B = 0"), (3.7, "end of the curve")])
def test_a_wall_held_by_a_real_root_moves_with_it(damping, kind):
    """Strong damping: the damped rigid wall's limit is the root z = -1 (x = b T/m above 3.7208)."""
    device = one_mass(0.001, damping)
    found = sensitivities(device)
    assert found.kind == kind
    numbers = {number.path: number.logarithmic for number in found.numbers}
    for path in ("plant.mass_kg", "plant.damping_Ns_per_m", "loop.sampling_period_s"):
        assert numbers[path] == pytest.approx(finite_difference(device, path, 1e-3), abs=1e-7)


def corners(loop):
    """Every corner of a pair's arc with the line of a real root: the wall, and the angles there."""
    arcs, _ = closed_rings(Tracer(loop))
    for arc, number in zip(arcs, arcs.next_arc, strict=True):
        following = arcs[number]
        kinds = {arc.kind, following.kind}
        angles = sorted({arc.end, following.start})
        away = abs(arc.last[0]) * loop.period > 1e-6 * abs(arc.last[1])  # no wall is stiffest at K = 0
        if PAIR in kinds and kinds & {PLUS, MINUS} and len(angles) == 2 and away:
            yield Peak(*arc.last, tuple(angles))


def test_corners_on_lines_of_real_roots_move_as_charts_say():
    """Any corner will do for the rule, whether the stiffest wall is there or not."""
    rng = np.random.default_rng(21)
    seen = {0.0: 0, np.pi: 0}
    while min(seen.values()) < 3:
        loop = random_loop(rng, ratios=(0.3, 1.0, 1.5))
        try:
            here = list(corners(loop))
            moved = [list(corners(scaled_plant(loop, "mass", 1.0 + h))) for h in (1e-5, -1e-5)]
        except ChartError:
            continue
        if not len(here) == len(moved[0]) == len(moved[1]):
            continue
        for corner, plus, minus in zip(here, *moved, strict=True):
            held = optimum(loop, corner)
            slope = central_derivative(change_over_factor(loop, held, "mass"), 1.0, 1.0).value
            scale = abs(corner.stiffness) + abs(slope)
            assert slope == pytest.approx((plus.stiffness - minus.stiffness) / 2e-5, abs=1e-3 * scale)
            seen[corner.angles[0] if corner.angles[0] == 0.0 else corner.angles[1]] += 1


def test_a_delay_of_whole_samples_bends_smoothly():
    """The force is one sample older: the derivative from either side is the same, to first order."""
    device = load("published-two-mass", [LATE])
    number = {n.path: n for n in sensitivities(device).numbers}["loop.delay_samples"]
    assert number.side == "above"
    for side in (1.0, -1.0):
        moved = from_document(address.assign(device.document, "loop.delay_samples", 1.0 + side * 1e-5))
        slope = np.log(largest(moved) / largest(device)) / (side * 1e-5)
        assert number.logarithmic == pytest.approx(slope, abs=1e-3)


def test_a_delay_that_is_not_given_is_reported_as_none():
    number = {n.path: n for n in sensitivities(one_mass()).numbers}["loop.delay_samples"]
    late = largest(one_mass(delay_samples=1e-4))
    assert (number.value, number.side) == (0.0, "above")
    assert np.isnan(number.logarithmic)
    assert "no logarithm" in number.reason
    assert number.derivative == pytest.approx((late - largest(one_mass())) / 1e-4, rel=1e-3)


def test_a_symmetric_matrix_stays_symmetric():
    document = load("published-two-mass").document
    document = address.assign(document, "plant.mass_kg", [[0.26, 0.004], [0.004, 0.026]])
    device = from_document(document)
    found = logarithmic(device)
    assert "plant.mass_kg.1.0" not in found
    moved = [
        largest(from_document(address.assign(document, "plant.mass_kg", [[0.26, m], [m, 0.026]])))
        for m in (0.004 * 1.001, 0.004 * 0.999)
    ]
    assert found["plant.mass_kg.0.1"] == pytest.approx(np.log(moved[0] / moved[1]) / 0.002, abs=1e-6)


def test_points_of_a_loop_are_no_symmetric_matrix():
    numbers = sensitivities_of("phantom-premium-1.5").numbers
    points = {one.path.partition("parallelogram.points_m.")[2] for one in numbers}
    assert {"0.1", "1.0", "1.2"} <= points


def test_numbers_that_say_where_are_left_out_and_named():
    found = sensitivities_of("five-bar")
    assert not any("reference" in n.path or "assemblies" in n.path for n in found.numbers)
    assert "operating point" in found.left_out["mechanism.reference.position_m.1"]
    paths = {n.path for n in found.numbers} | found.left_out.keys() | {"loop.delay_samples"}
    assert paths == address.numeric_addresses(load("five-bar").document).keys() | {"loop.delay_samples"}


def test_sorted_by_what_helps_most_and_failures_are_data():
    found = sensitivities_of("five-bar", FILTER)
    magnitudes = [abs(n.logarithmic) for n in found.numbers if not np.isnan(n.logarithmic)]
    assert magnitudes == sorted(magnitudes, reverse=True)
    of = {n.path: n for n in found.numbers}
    assert "whole number" in of["loop.velocity.filter.order"].reason
    assert np.isnan(of["loop.velocity.filter.order"].logarithmic)
    # out of the plane the loop does not close
    assert of["mechanism.links.upper-left.origin_m.2"].reason
    assert of["mechanism.drives.motor-left.torque_constant_Nm_per_A"].logarithmic == 0.0
    assert of["mechanism.drives.motor-left.stiffness_Nm_per_rad"].unit == "N m/rad"


def test_without_a_stable_wall_nothing_is_said():
    found = sensitivities(load("published-two-mass", ["plant.damping_Ns_per_m=unset", LATE]))
    assert (found.peak, found.numbers, found.groups, found.tie) == (None, (), (), False)


def test_a_second_summit_is_named_and_a_tie_is_called_so():
    """Walls that are stiffest among their neighbours: stable just below, and unstable just above."""
    rng = np.random.default_rng(11)
    seen = 0
    while seen < 3:
        loop = random_loop(rng, ratios=(0.05, 0.3))
        try:
            chart = stability_chart(loop, decay=False)
        except ChartError:
            continue
        rival = second_peak_stiffness(chart)
        if np.isnan(rival):
            continue
        seen += 1
        assert 0.0 < rival <= chart.stiffness_max * (1.0 + 1e-6)
        walls = np.vstack(chart.regions)
        B = walls[np.argmin(np.where(walls[:, 1] >= 0.0, np.abs(walls[:, 0] - rival), np.inf)), 1]
        assert chart.check(rival * (1.0 + 1e-4), B).names != "stable"
    found = sensitivities(one_mass())
    assert not found.tie
    assert replace(found, second_peak=found.peak.stiffness).tie


def test_slopes_know_what_they_are_worth():
    for of, at, exact in ((np.exp, 1.0, np.e), (np.sin, 0.3, np.cos(0.3)), (lambda x: x**5, 1.0, 5.0)):
        for slope in (
            central_derivative(of, at, at),
            one_sided_derivative(of, at, at, 1),
            one_sided_derivative(of, at, at, -1),
        ):
            assert abs(slope.value - exact) < 1e-8
            assert abs(slope.value - exact) <= 10.0 * slope.error + 1e-13

    rng = np.random.default_rng(3)
    slopes = [central_derivative(lambda x: np.exp(x) + 1e-10 * rng.normal(), 1.0, 1.0) for _ in range(50)]
    errors = np.array([abs(slope.value - np.e) for slope in slopes])
    estimates = np.array([slope.error for slope in slopes])
    assert np.median(errors) < 1e-7
    assert np.mean(errors > 10.0 * estimates) < 0.1


def test_the_operator_and_the_load_of_the_point_are_those_of_the_answer():
    held, free = load("published-two-mass").held_by("thesis-arm"), load("published-two-mass")
    of_file, of_point = held.sensitivities(), free.sensitivities(free.at(operator="thesis-arm"))
    # By their text: from Python 3.13 on a NaN, of what has no logarithm, does not even equal itself within them.
    assert repr(of_point.numbers) == repr(of_file.numbers)
    assert repr(of_point.numbers) != repr(free.sensitivities().numbers)
    device = load("five-bar")
    of_file, of_point = device.under((0.0, -5.0)), device.at(load=(0.0, -5.0))
    assert device_of_point(device, of_point).document == of_file.document
    assert device_of_point(of_file, device.at()).document == device.document
    assert device_of_point(of_file, of_file.at()) is of_file


def test_groups_that_matter_alike_stand_in_the_order_of_the_file():
    """No order of a set of texts, which differs from one process to the next."""
    groups = load("openwrist").sensitivities().groups
    paths = [group.path for group in groups if group.logarithmic == 0.0]
    each = [f"mechanism.links.{link}.limits_rad" for link in ("pronation", "flexion", "deviation")]
    assert [path for path in paths if path.endswith(".limits_rad")] == [
        each[0], "mechanism.links.*.limits_rad", *each[1:]
    ]  # fmt: skip
