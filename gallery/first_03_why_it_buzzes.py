"""Why it buzzes: a wall 20 % too stiff, on a device with dry friction, an encoder and a weak motor.

The chart says that vibrations grow there. Friction and encoder steps rule the small ones, the motor's largest
force the large ones, and so the growth ends in a limit cycle: that is what is felt and heard. Harmonic balance
predicts its size and frequency, a simulation shows them.
"""

import zwidth

paddle = zwidth.load("hapkit-course", {"loop.delay_samples": 1, "loop.encoder.resolution_m": 20e-6})
point = paddle.with_({"friction.coulomb_N": 0.05, "loop.saturation.force_N": 5.0}).at()

chart = point.chart()
K, B = 1.2 * chart.stiffness_max, chart.damping_at_stiffness_max
print(f"stable up to {chart.stiffness_max:.0f} N/m; {K:.0f} N/m: {point.check(K, B).names[0]}")

cycle = point.limit_cycles(K, B, simulate=False).cycles[-1]
print(f"predicted: {1e3 * cycle.amplitude:.1f} mm at {cycle.frequency_Hz:.0f} Hz")
buzz = point.simulate(K, B, duration=1.0)
print(f"simulated: {1e3 * buzz.amplitude:.1f} mm at {buzz.dominant_frequency:.0f} Hz, a {buzz.behaviour}")


def figure():
    """The first 0.2 s, from 1 mm inside the wall."""
    ax = buzz.plot()
    ax.set_xlim(0.0, 0.2)
    return ax


if __name__ == "__main__":
    figure().figure.savefig("first_03_why_it_buzzes.png")
