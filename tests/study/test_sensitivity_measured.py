"""Sensitivities of a measured device beside those of the plant that the data are made of."""

from __future__ import annotations

import pytest

from tests import systems
from tests.measured_handle_cases import RECIPROCAL, frequencies, measured_device
from zwidth.device.load import load

T = 0.00125
LOOP = """[loop]
sampling_period_s = 0.00125
{}[loop.velocity]
filter = {{ type = "butterworth", order = 2, cutoff_Hz = 60.0 }}
"""
HAND = """[operator]
arm_mass_kg = 0.8
arm_stiffness_N_per_m = 580.0
arm_damping_Ns_per_m = 5.5
grasp_stiffness_N_per_m = 10000.0
grasp_damping_Ns_per_m = 5.0
"""
PLANT = """name = "m"
[plant]
mass_kg = [[0.2616, 0.0], [0.0, 0.0254]]
damping_Ns_per_m = [[1.8744, -1.8744], [-1.8744, 1.8744]]
stiffness_N_per_m = [[15620.0, -15620.0], [-15620.0, 15620.0]]
actuator = [0.0, 1.0]
sensor = [0.0, 1.0]
handle = [1.0, 0.0]
"""


def columns(name):
    return f"{name}_real_m_per_N,{name}_imag_m_per_N"


@pytest.fixture
def pair(tmp_path):
    """A measured device and the same as a plant."""
    response = measured_device(systems.published().plant, T, 0.4, RECIPROCAL, frequencies(T, 400))
    paths = [response.value, response.handle.force_to_encoder.value, response.handle.force_to_handle.value]
    cells = [response.frequency, *(part for path in paths for part in (path.real, path.imag))]
    head = f"frequency_Hz,real_m_per_N,imag_m_per_N,{columns('handle_force_to_encoder')}"
    lines = [f"{head},{columns('handle_force_to_handle')}"]
    lines += [",".join(repr(float(cell)) for cell in row) for row in zip(*cells, strict=True)]
    (tmp_path / "sweep.csv").write_text("\n".join(lines) + "\n")
    measured = 'name = "m"\n[response]\nfile = "sweep.csv"\nactuator_at = "sensor"\n' + LOOP.format("")
    (tmp_path / "measured.toml").write_text(measured + HAND)
    (tmp_path / "plant.toml").write_text(PLANT + LOOP.format("delay_samples = 0.4\n") + HAND)
    return tmp_path / "measured.toml", tmp_path / "plant.toml"


def test_sensitivities_are_those_of_the_plant(pair):
    measured, plant = (load(path, operator="none").sensitivities() for path in pair)
    own, exact = ({number.path: number for number in one.numbers} for one in (measured, plant))
    assert measured.peak.stiffness == pytest.approx(plant.peak.stiffness, rel=1e-4)
    assert measured.peak.angles == pytest.approx(plant.peak.angles, rel=1e-3)
    filtered = "loop.velocity.filter.cutoff_Hz"
    assert own[filtered].logarithmic == pytest.approx(exact[filtered].logarithmic, rel=1e-3)
    # the file's delay is what software adds, which is none
    delay, period = "loop.delay_samples", "loop.sampling_period_s"
    assert own[delay].derivative == pytest.approx(exact[delay].derivative, rel=2e-3)
    assert "no logarithm" in own[delay].reason
    # the device's own delay stays in seconds, the plant's in samples
    assert own[period].logarithmic == pytest.approx(exact[period].logarithmic - exact[delay].logarithmic, rel=2e-3)
    assert "whole number" in own["loop.velocity.filter.order"].reason
    assert "[plant] or" in measured.left_out["[response]"]


@pytest.mark.slow
def test_the_operators_numbers_are_varied(pair):
    measured, plant = (load(path).sensitivities() for path in pair)
    own, exact = ({number.path: number for number in one.numbers} for one in (measured, plant))
    for path in ("operator.grasp_damping_Ns_per_m", "operator.grasp_stiffness_N_per_m"):
        assert own[path].logarithmic == pytest.approx(exact[path].logarithmic, rel=5e-3)
