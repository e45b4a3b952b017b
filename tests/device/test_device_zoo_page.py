"""The page on bundled devices is what the code says today, and names every device."""

from __future__ import annotations

import pytest

from tests.lazy_module import LazyModule
from zwidth.device import bundled_names
from zwidth.device.load import load

make_zoo = LazyModule("docs.make_zoo")


def test_the_page_is_what_a_run_writes():
    assert make_zoo.PAGE.read_text(encoding="utf-8") == make_zoo.page()


def test_every_device_has_its_row():
    rows = {one.name: one.cells for one in make_zoo.rows()}
    assert sorted(rows) == bundled_names()
    for name, cells in rows.items():
        missing = load(name).missing
        assert (cells[2] == "charts") == (not missing), name
        assert bool(cells[6]) == (not missing), name  # the largest wall


def test_limits_set_by_hand_are_those_of_bundled_devices():
    assert set(make_zoo.SET_BY_HAND) <= set(bundled_names())


def test_masses_of_a_symmetric_arm_are_those_of_its_axes():
    """All three axes of the Premium's Jacobian at zero are orthogonal: M_ii + n_i^2 J over the squared arm."""
    device = load("phantom-premium-1.5")
    drives, M = device.mechanism.drives, device.at().posture.mass_matrix
    whole = M.diagonal() + drives.transmission**2 * drives.motor_inertia
    expected = sorted(whole / [0.215**2, 0.215**2, 0.170**2])
    assert make_zoo.masses(device.at()) == pytest.approx([expected[0], expected[-1]], rel=1e-12)
