"""A sweep: the largest stiffness for every combination of a sampling period and a delay.

Axes are paths of the device file with their values, and what comes back is an xarray dataset over them. Half the
period brings four times the stiffness and more, one sample of delay takes most of it away. At 2 ms a second sample
of delay helps: with flexible drives it depends on the phase at which the wall meets their vibration.
"""

import zwidth

device = zwidth.load("published-two-mass")
results = zwidth.sweep(
    device,
    {"loop.sampling_period_s": [0.00025, 0.0005, 0.001, 0.002], "loop.delay_samples": [0, 1, 2]},
    "stiffness_max",
)
stiffness = results["stiffness_max"]
print(stiffness.to_pandas().round().astype(int))


def figure():
    """A line for each delay."""
    lines = stiffness.plot.line(x="loop.sampling_period_s", yscale="log", marker="o", xticks=[5e-4, 1e-3, 2e-3])
    lines[0].figure.set_layout_engine("constrained")
    return lines[0].axes


if __name__ == "__main__":
    figure().figure.savefig("first_07_a_sweep.png")
