"""Fig. 5.10: how fast vibration decays all over the chart, and the eigenvalues' way across it at K = 4000 N/m.

Left, the published two masses' chart, with the walls whose slowest motion shrinks by the same factor per sample.
Right, the five eigenvalues of the transition matrix (2.40) while the virtual damping rises from -2 to 35 N s/m:
the chart's edges are where a pair crosses the unit circle. Of three crossings the second lets the slow pair in
(17 Hz, the lower edge) and the third lets the fast one out (201 Hz, just beyond the imaginary axis, which is a
quarter of the sampling frequency: the upper edge).

Point A is the wall of fastest decay: there a pair and a double real eigenvalue have one radius.

Run `python -m gallery.fig_5_10_eigenvalues` to draw it.
"""

from __future__ import annotations

import numpy as np

from gallery.fig_3_7_bilateral_wall import chart, loop
from gallery.shared_loops import published, write_page
from zwidth.chart import eigenvalues, spectral_radius
from zwidth.measures import wall_paths
from zwidth.measures.root_paths import Crossing

K = 4000.0  # N/m
LOWEST, HIGHEST = -2.0, 35.0  # N s/m
RADII = (0.99, 0.98, 0.97, 0.96, 0.95)

paths = wall_paths(loop, K, np.linspace(LOWEST, HIGHEST, 75))


def frequency(crossing: Crossing) -> float:
    """Of the vibration that starts or ends there [Hz]."""
    return float(np.angle(crossing.eigenvalue) / (2.0 * np.pi * loop.period))


# Of each conjugate pair the one above the real axis.
crossings = [found for found in paths.crossings if found.eigenvalue.imag > 0.0]
fast_in, slow_in, fast_out = crossings
# How far past the imaginary axis the pair leaves [degrees].
beyond_the_axis = float(np.degrees(np.angle(fast_out.eigenvalue))) - 90.0


def path_extent(path: int) -> float:
    """How far an eigenvalue gets from where it enters, over the stable part of the way."""
    inside = (paths.values >= slow_in.value) & (paths.values <= fast_out.value)
    z = paths.eigenvalues[inside, path]
    return float(np.abs(z - z[0]).max())


_real = int(np.argmin(np.abs(paths.eigenvalues.imag).max(axis=0)))
moves = {
    "fast pair": path_extent(fast_out.path),
    "slow pair": path_extent(slow_in.path),
    "real": path_extent(_real),
}
# The slow pair's largest modulus within the caption's range: it starts outside.
slow_at_first = float(abs(paths.eigenvalues[0, slow_in.path]))

best = chart.fastest_decay
point_A = (best.stiffness, best.damping)
_roots = eigenvalues(loop, *point_A)
real_at_A = np.sort(_roots[np.abs(_roots.imag) < 1e-4].real)
pair_at_A = complex(_roots[np.argmax(_roots.imag)])
# Among walls the rigid mass renders A is well inside: its own slowest motion there.
rigid_at_A = float(spectral_radius(published("rigid", stiffness_damping=0.0), *point_A))


def draw(figure) -> None:
    """The chart and the way."""
    from zwidth.show import BLACK, draw_decay_contours

    left, right = figure.subplots(1, 2, width_ratios=(1.0, 0.95))
    draw_decay_contours(left, loop, RADII, (-2000.0, 8000.0, LOWEST - 1.0, HIGHEST), chart)
    left.annotate("A", point_A, xytext=(-22, -3), textcoords="offset points", fontsize=9.0)
    left.plot([K, K], [LOWEST, HIGHEST], color=BLACK, linewidth=0.8, linestyle=(0, (1.0, 1.5)))
    draw_paths(right)


def draw_paths(ax) -> None:
    """Eigenvalues in the complex plane, along the way and at A."""
    from zwidth.show import BLUE, VERMILION, legend_above
    from zwidth.show.figures.style import GREEN

    draw_circle(ax)
    for path in range(paths.eigenvalues.shape[1]):
        z = paths.eigenvalues[:, path]
        text = "" if path else f"{K:.0f} N/m, from {LOWEST:g} to {HIGHEST:g} Ns/m".replace("-", "\u2212")
        ax.plot(z.real, z.imag, color=BLUE, linewidth=1.4, label=text)
        ax.plot(z[0].real, z[0].imag, "o", markerfacecolor="white", markeredgecolor=BLUE, markersize=4.0)
        middle = len(z) // 2
        ax.annotate(
            "",
            (z[middle + 1].real, z[middle + 1].imag),
            (z[middle].real, z[middle].imag),
            arrowprops={"arrowstyle": "-|>", "color": BLUE, "mutation_scale": 9.0},
        )
    for n, found in enumerate(paths.crossings):
        text = "" if n else "on the circle"
        ax.plot(found.eigenvalue.real, found.eigenvalue.imag, "x", color=VERMILION, markersize=6.0, label=text)
    ax.plot(_roots.real, _roots.imag, "D", color=GREEN, markersize=4.0, linestyle="none", label="at A")
    legend_above(ax, columns=1)


def draw_circle(ax) -> None:
    """The unit circle, with its axes."""
    from zwidth.show import GREY

    t = np.linspace(0.0, 2.0 * np.pi, 361)
    ax.plot(np.cos(t), np.sin(t), color=GREY, linewidth=0.8, zorder=0.8)
    for line in (ax.axhline, ax.axvline):
        line(0.0, color=GREY, linewidth=0.5, zorder=0.5)
    ax.set_aspect("equal")
    ax.set_xlim(-1.15, 1.15)
    ax.set_ylim(-1.15, 1.15)
    ax.set_xlabel("Re z")
    ax.set_ylabel("Im z")


if __name__ == "__main__":
    for found in crossings:
        way = "out" if found.outwards else "in"
        print(f"{found.value:.6f} N s/m: {way} at {frequency(found):.2f} Hz, z = {found.eigenvalue:.4f}")
    print("eigenvalues move by at most", {name: f"{value:.3f}" for name, value in moves.items()})
    print(f"A: {point_A[0]:.2f} N/m, {point_A[1]:.4f} N s/m, real {real_at_A}, pair {pair_at_A:.6f}")
    write_page(draw, "fig-5-10-eigenvalues", 7.4, 4.6)
