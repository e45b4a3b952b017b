"""Figs. 5.12 to 5.14, left: eigenvalues at the walls B, C and D while the motor-side mass grows.

From 0.01 to 0.2 kg, of the two masses with structural damping (five eigenvalues) and of the motor's mass on its
spring without (three). With little mass the fast pair is outside; it enters the unit circle at the mass from which
the wall is stable, gets faster until the mass of (5.14), where its radius is (5.15), and slower again. The fast
pairs of the two models go much the same way. Of the two masses there is a slow pair besides, which both make
together: it hardly takes notice, and from a smaller mass on it is what decays last.

(The caption has the two masses dashed and the single one solid, the text the reverse.) What is simulated on the
right is in `gallery.fig_5_12_before_and_after`.

Run `python -m gallery.fig_5_12_eigenvalue_paths` to draw them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from gallery import optimal_mass
from gallery.brute_force import BruteForceLoop
from gallery.fig_5_10_eigenvalues import draw_circle
from gallery.fig_5_11_spectral_radii import LOOPS, WALLS
from gallery.shared_loops import write_page
from zwidth.chart import eigenvalues
from zwidth.loop import Loop
from zwidth.measures import EigenvaluePaths, fastest_mass, loop_paths, with_motor_side_mass

LIGHTEST, HEAVIEST = 0.01, 0.2  # kg
MODELS = ("two masses", "motor's mass")
STRUCTURAL = 50.0  # Hz


def with_mass(model: str, mass: float) -> Loop:
    """A model with another motor-side mass [kg]."""
    return replace(LOOPS[model], plant=with_motor_side_mass(LOOPS[model].plant, mass))


@dataclass(frozen=True)
class ModelPaths:
    """Eigenvalues of one model at one wall over the mass.

    stable_from  mass at which the last pair enters the unit circle [kg]
    fastest      mass of the least spectral radius [kg], and that radius
    """

    paths: EigenvaluePaths
    stable_from: float
    fastest: tuple[float, float]


def paths_over_mass(model: str, wall: tuple[float, float]) -> ModelPaths:
    """Followed over the masses."""
    paths = loop_paths(lambda mass: with_mass(model, mass), np.geomspace(LIGHTEST, HEAVIEST, 40), *wall)
    entering = [found.value for found in paths.crossings if not found.outwards]
    return ModelPaths(paths, max(entering), fastest_mass(LOOPS[model], *wall, LIGHTEST, HEAVIEST))


model_paths = {name: {model: paths_over_mass(model, wall) for model in MODELS} for name, wall in WALLS.items()}


def fast_radius(model: str, name: str, mass: float) -> float:
    """Largest modulus of the eigenvalues above 50 Hz; nan if there are none."""
    z = eigenvalues(with_mass(model, mass), *WALLS[name])
    fast = np.abs(np.angle(z)) > 2.0 * np.pi * STRUCTURAL * LOOPS[model].period
    return float(np.abs(z[fast]).max()) if fast.any() else np.nan


# At the mass of (5.14): the fast pair of both models.
at_optimum = {
    name: {model: fast_radius(model, name, optimal_mass.optimum[name][0]) for model in MODELS} for name in WALLS
}


def _fastest_pair(name: str) -> tuple[float, float]:
    masses = np.geomspace(0.5, 1.5, 31) * optimal_mass.optimum[name][0]
    best = float(masses[np.nanargmin([fast_radius("two masses", name, mass) for mass in masses])])
    near = (best / 1.04, best * 1.04)
    found = minimize_scalar(lambda mass: fast_radius("two masses", name, mass), bounds=near, method="bounded")
    return float(found.x), float(found.fun)


# Mass at which the fast pair of the two masses decays fastest, and its radius there.
fastest_pair = {name: _fastest_pair(name) for name in WALLS}


def radius_by_brute_force(model: str, name: str, motor_side_mass: float) -> float:
    """Spectral radius at a wall with another motor-side mass [kg], by brute force."""
    plant = LOOPS[model].plant
    place = int(np.argmax(plant.actuator))
    mass = plant.mass.copy()
    mass[place, place] = motor_side_mass
    return float(
        BruteForceLoop(mass, plant.damping, plant.stiffness, plant.actuator, LOOPS[model].period).radius(
            *WALLS[name]
        )
    )


def judged_stable_from(model: str, name: str) -> float:
    """The mass from which the wall is stable, by bisection of brute force's eigenvalues between two masses."""
    low, high = LIGHTEST, optimal_mass.optimum[name][0]
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if radius_by_brute_force(model, name, middle) < 1.0 else (middle, high)
    return high


def draw(figure) -> None:
    """One panel for each wall."""
    axes = figure.subplots(1, 3)
    for ax, name in zip(axes, WALLS, strict=True):
        draw_model_paths(ax, name)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper left", ncols=2, frameon=False, fontsize=8.0, handlelength=2.6
    )


def draw_model_paths(ax, name: str) -> None:
    """The upper half plane; below it all is mirrored."""
    from zwidth.show import BLACK, BLUE, VERMILION

    draw_circle(ax)
    ax.set_ylim(-0.25, 1.25)
    styles = {"two masses": (BLACK, "-"), "motor's mass": (BLUE, (0, (4, 1.5)))}
    texts = {"two masses": "two masses, damped", "motor's mass": "motor's mass on its spring, undamped"}
    for model, (colour, dashes) in styles.items():
        z = model_paths[name][model].paths.eigenvalues
        shown = np.where(z.imag >= -1e-9, z, np.nan)
        for path in range(z.shape[1]):
            line = shown[:, path]
            text = "" if path else texts[model]
            ax.plot(line.real, line.imag, color=colour, linestyle=dashes, linewidth=1.3, label=text)
        for mass, mark, size in ((LIGHTEST, "o", 3.5), (optimal_mass.optimum[name][0], "x", 6.0)):
            roots = eigenvalues(with_mass(model, mass), *WALLS[name])
            roots = roots[roots.imag >= -1e-9]
            text = f"at {LIGHTEST} kg" if mark == "o" else "with the mass of (5.14)"
            ax.plot(
                roots.real,
                roots.imag,
                mark,
                color=VERMILION if mark == "x" else colour,
                markersize=size,
                linestyle="none",
                label=text if model == "two masses" else "",
            )
    K, B = WALLS[name]
    ax.set_title(f"{name}: {K:.0f} N/m, {B:.0f} Ns/m", loc="left", fontsize=8.0)


if __name__ == "__main__":
    for name, each in model_paths.items():
        for model, found in each.items():
            mass, rho = found.fastest
            print(
                f"{name}, {model}: stable from {found.stable_from:.6f} kg; fastest {rho:.6f} at {mass:.6f} kg; "
                f"fast pair at (5.14) {at_optimum[name][model]:.4f}"
            )
    write_page(draw, "fig-5-12-eigenvalue-paths", 7.6, 2.7)
