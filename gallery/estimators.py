"""Velocity estimators: equally late, unequally noisy, and what they cost in walls.

A position known to a count of the encoder gives a velocity known to a count per sample: 8 mm/s for 10 um at
800 Hz. Every remedy looks further back, and most are late for it. Four of the methods below are late by the same
four samples at low frequencies; what they pass of white noise differs by a factor of 1.7, the steady Kalman filter
being the quietest and the plain windowed difference the noisiest. The parabola that is followed to its newest
position is not late at all there, but passes nearly three times the windowed difference's noise from as many
samples, and shows vibrations in between half as large again as they are.

On the edge of stability, with w = w(z) on the unit circle,

    K = Re(-1/P) - Im(-1/P) Re w / Im w,      B = Im(-1/P) / Im w

so K depends on the phase of w alone. On one free mass the windowed difference and the least-squares slope of the
same delay reach the same stiffness to the last digit, a twelfth of the backward difference's. With flexible drives
the order is another: the vibration at 140 Hz decides as much as the hand's motion at 16 Hz, a short delay or none
helps little, and the parabola that is not late reaches the least.

Run `python -m gallery.estimators` to draw gain, phase delay and charts.
"""

from __future__ import annotations

from gallery.shared_loops import published, write_figure
from zwidth.chart import StabilityChart, stability_chart
from zwidth.loop import (
    AlphaBeta,
    BackwardDifference,
    CentralDifference,
    Kalman,
    LeastSquaresSlope,
    SavitzkyGolay,
    WindowedDifference,
    quantisation_noise,
)

PERIOD = 0.00125  # s
RESOLUTION = 10e-6  # m
WANTED = 4.0 * PERIOD  # delay of those that are equally late

# both poles at q: the delay (1 + q)/(1 - q) - 1/2 samples is 4
q = 3.5 / 5.5
tracker = AlphaBeta(1.0 - q**2, (1.0 - q) ** 2)
# the delay r/(1 - r) samples is 4 at r = 0.8, where the tracking index 2 (1 - r)^2/r is 0.1
acceleration = 0.1 * quantisation_noise(RESOLUTION) / PERIOD**2

methods = {
    "backward difference": BackwardDifference(),
    "windowed difference, 8 samples": WindowedDifference(8),
    "least-squares slope of 9": LeastSquaresSlope(9),
    "parabola at the newest of 9": SavitzkyGolay(9, 2),
    "alpha-beta, both poles at 0.64": tracker,
    "Kalman, index 0.1": Kalman.of_encoder(acceleration, RESOLUTION),
    "central difference": CentralDifference(),
}
delays = {name: method.delay(PERIOD) for name, method in methods.items()}
noise_gains = {name: method.noise_gain(PERIOD) for name, method in methods.items()}
equally_late = [name for name, delay in delays.items() if abs(delay - WANTED) < 1e-12]


def charts(model: str | None, stiffness_damping: float | None) -> dict[str, StabilityChart]:
    """The plant of Table 3.4 with every method."""
    return {
        name: stability_chart(published(model, stiffness_damping, velocity=method), decay=False)
        for name, method in methods.items()
    }


rigid = charts("rigid", 0.0)  # one free mass
flexible = charts(None, None)  # two masses


def draw_gain(ax) -> None:
    """Estimated per true velocity."""
    from zwidth.show.figures import estimators

    estimators.draw_gain(ax, methods, PERIOD)


def draw(ax) -> None:
    """How late the estimates are."""
    from zwidth.show.figures import estimators

    estimators.draw_phase_delay(ax, methods, PERIOD)


def draw_walls(ax) -> None:
    """What is stable with two masses."""
    from zwidth.show import draw_models

    first = flexible["backward difference"]
    window = (0.0, 1.05 * first.stiffness_max, 0.0, 1.05 * first.damping_max)
    names = [name for name in methods if name not in equally_late or name.startswith(("windowed", "least"))]
    draw_models(ax, {name: flexible[name] for name in names}, window)


if __name__ == "__main__":
    write_figure(draw_gain, "estimators-gain")
    write_figure(draw, "estimators-delay")
    write_figure(draw_walls, "estimators-walls")
