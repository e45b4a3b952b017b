"""My first device: a paddle typed in as text, the walls it renders, and what limits them.

A device file is TOML, and the shortest one has a [plant], a mass with its friction, and the computer's [loop]. The
chart holds every stable wall of stiffness K and damping B. `what_if` charts the device again with one thing
changed at a time; the change that gains most names what limits it.
"""

import tomllib

import zwidth

FILE = """
name = "my paddle"

[plant]
mass_kg = 0.05
damping_Ns_per_m = 0.4

[loop]
sampling_period_s = 0.001
delay_samples = 1
"""

device = zwidth.from_document(tomllib.loads(FILE))
chart = device.chart()
print(chart)

limit = zwidth.study.limiting_change(zwidth.study.what_if(device))
print(f"what would help most: {limit.label}, up to {limit.stiffness_max:.0f} N/m")


def figure():
    """The stable walls, and the stiffest of them."""
    return chart.plot()


if __name__ == "__main__":
    figure().figure.savefig("first_01_my_first_device.png")
