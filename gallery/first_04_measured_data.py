"""Measured data: from recorded forces and encoder readings to the stable walls, without a model.

Excite the device with noise, and record the commanded force and the reading at every sample. Here 20 s of a known
mass on viscous friction stand in for the recording, so that the answer can be checked. The device is free to move,
hence the two integrators. Of a measurement the band counts, not its middle: it holds the true value.
"""

import numpy as np
from scipy.signal import lfilter

import zwidth

T, mass, friction = 0.001, 0.1, 1.0  # s, kg, N s/m
force = np.random.default_rng(1).normal(0.0, 2.0, 20_000)
left = np.exp(-friction * T / mass)  # of a velocity after T
velocity = lfilter([0.0, (1.0 - left) / friction], [1.0, -left], force)
moved = (force * T - mass * np.diff(velocity, append=0.0)) / friction  # from sample to sample, by the momentum
reading = 1e-6 * np.round(lfilter([0.0, 1.0], [1.0, -1.0], moved) / 1e-6)

response = zwidth.sweep_response(force, reading, T, integrators=2, segment=512)
chart = zwidth.chart.measured_chart(response, zwidth.Controller(T))
print(f"measured: {chart.band.stiffness_low / 1e3:.1f} to {chart.band.stiffness_high / 1e3:.1f} kN/m")
print("50 kN/m with 20, 80 and 140 N s/m:", ", ".join(chart.check(50e3, [20.0, 80.0, 140.0]).names))

truth = zwidth.Loop(zwidth.Plant.one_mass(mass, friction), sampling_period=T).chart()
print(f"true: {truth.stiffness_max / 1e3:.1f} kN/m")


def figure():
    """The measured edge and its band."""
    return chart.plot()


if __name__ == "__main__":
    figure().figure.savefig("first_04_measured_data.png")
