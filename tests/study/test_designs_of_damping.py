"""Designs that differ in their damping and in nothing of their mechanism, computed together and alone."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth

COUNT = 40
RATIO = {"damping.mode_ratio": np.linspace(0.02, 0.12, COUNT)}
COEFFICIENTS = {
    "damping.mass_coefficient_1_per_s": np.linspace(0.1, 5.0, COUNT),
    "damping.stiffness_coefficient_s": np.linspace(1e-5, 3e-4, COUNT),
}
PERIOD = {"loop.sampling_period_s": np.linspace(0.001, 0.0015, COUNT)}


@pytest.mark.parametrize("model", ["full", "two-mass"])
@pytest.mark.parametrize("axes", [RATIO, RATIO | PERIOD, COEFFICIENTS | PERIOD])
def test_each_has_the_value_that_it_has_alone(axes, model):
    device = zwidth.load("five-bar")
    if axes is not RATIO and "damping.mode_ratio" not in axes:
        device = device.with_({"damping.mass_coefficient_1_per_s": 1.0, "damping.stiffness_coefficient_s": 1e-4})
    grid = zwidth.study.plane_of(device, cells=(2, 2))
    found = zwidth.sweep(
        device, axes, ["stiffness_max", "worst(stiffness_max)"], paired=True, model=model, plane=grid
    )
    assert not found["stiffness_max_status"].any()
    for n in (0, 17, COUNT - 1):
        alone = device.with_({key: float(values[n]) for key, values in axes.items()})
        assert float(found["stiffness_max"][n]) == pytest.approx(
            alone.at(model=model).chart().stiffness_max, rel=1e-9
        )
        worst = np.nanmin(zwidth.workspace_map(alone, "stiffness_max", model=model, plane=grid)["stiffness_max"])
        assert float(found["worst(stiffness_max)"][n]) == pytest.approx(worst, rel=1e-9)
