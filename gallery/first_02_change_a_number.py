"""Change a number: a shorter sampling period, before and after, and how much each number matters.

Every number of a device file has a path with dots, and `with_` gives the device with another value there. A
sensitivity is the per cent of the largest stiffness that one per cent of a number brings: it says what to change
first, and holds for small changes only.
"""

import zwidth

device = zwidth.load("five-bar")
sensitivities = device.sensitivities()
for path, share in sensitivities.ranking[:3]:
    print(f"{path}: {share:+.3f} % for 1 % more")

before = device.chart().stiffness_max
print(f"every 1.25 ms: {before:.0f} N/m")
for period in (0.0012375, 0.000625):  # 1 % less, and half
    faster = device.with_({"loop.sampling_period_s": period})
    after = faster.chart().stiffness_max
    print(f"every {1e3 * period:.4g} ms: {after:.0f} N/m, {after / before - 1.0:+.3%}")


def figure():
    """What to change first."""
    return sensitivities.plot()


if __name__ == "__main__":
    figure().figure.savefig("first_02_change_a_number.png")
