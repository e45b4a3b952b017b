"""Bundled devices of which only geometry is known answer kinematic questions and refuse the others in a
sentence."""

from __future__ import annotations

import json

import numpy as np
import pytest

import zwidth
from tests.cli.command_runner import run_command
from zwidth.device import bundled_names
from zwidth.errors import MissingNumbersError

GEOMETRY = [name for name in bundled_names() if zwidth.load(name).missing.get("dynamics")]
WITH_WORKSPACE = [name for name in GEOMETRY if np.isfinite(zwidth.load(name).mechanism.workspace[:2]).all()]


def test_they_are_said_to_be_so_where_devices_are_listed():
    for name in GEOMETRY:
        said = zwidth.load(name).description
        assert "geometry only" in said or "transmission only" in said, name
    known = [name for name in bundled_names() if name not in GEOMETRY]
    assert not any("only:" in zwidth.load(name).description for name in known)
    assert len(GEOMETRY) >= 11


@pytest.mark.parametrize("name", GEOMETRY)
def test_a_chart_is_refused_in_a_sentence(name):
    ran = run_command("chart", name)
    assert ran.code == 1
    assert ran.out == ""
    (line,) = ran.err.strip().splitlines()
    assert "mass_kg" in line
    with pytest.raises(MissingNumbersError, match="mass_kg"):
        zwidth.load(name).at().chart()


@pytest.mark.parametrize("name", GEOMETRY)
def test_what_is_known_is_shown(name):
    ran = run_command("show", name)
    assert ran.code == 0, ran.err
    assert "masses felt" in " ".join(ran.out.split())
    assert "isotropy" in ran.out
    document = json.loads(run_command("show", name, "--json").out)
    masses = [value for key, value in document.items() if key.startswith(("link_side_", "rigid_"))]
    assert masses == [None, None]
    assert document["natural_frequencies_Hz"] is None
    assert document["mass_matrix"] is None
    point = zwidth.load(name).at()
    np.testing.assert_allclose(document["jacobian"], point.posture.jacobian)
    assert "not known" in repr(point.describe())
    assert "nan" not in repr(point)


@pytest.mark.parametrize("name", WITH_WORKSPACE)
def test_isotropy_is_mapped(name):
    device = zwidth.load(name)
    maps = zwidth.workspace_map(device, ["isotropy"], zwidth.study.plane_of(device, cells=(5, 5)))
    values = maps["isotropy"].to_numpy()
    assert np.isfinite(values).sum() >= 6
    assert np.nanmin(values) >= 1.0
