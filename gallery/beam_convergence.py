"""How far off the first frequency of a beam is by each method, over how many elements or modes it has.

Exact ones are roots x of characteristic equations of the uniform Euler-Bernoulli beam, of mass m, with the
frequency w = x^2 sqrt(EI / (m L^3)):

    clamped                   1 + cos x cosh x = 0
    clamped, a mass on tip    1 + cos x cosh x + x (cos x sinh x - sin x cosh x) = 0            the mass m
    on a hub that turns       sin x cosh x - cos x sinh x + x^3 (1 + cos x cosh x) = 0          its inertia m L^2

The last is what a link on its motor does, the other end free.

Run `python -m gallery.beam_convergence` for the table, `python docs/make_images.py` for the picture.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isnan, log2
from typing import Any, NamedTuple

import numpy as np
from numpy import cos, cosh, sin, sinh
from scipy.linalg import block_diag, eigh
from scipy.optimize import brentq

from zwidth.model import BeamProperties, FlexibleBody, assumed_modes, finite_elements, lumped_tip

L, MASS, EI = 0.2, 0.05, 10.0
# so stiff in all but bending in the x-y plane that the first frequency is one of that
BEAM = BeamProperties(L, 1e5 * EI, EI, 1e4 * EI, 1e8 * EI, MASS / L, 1e-5)
TURN = 5  # rotation about z among the six motions of the base
OF_CRAIG_BAMPTON = 16  # elements, of which modes are kept
ROUNDING = 1e-12  # an error below it is none
LEAST_SHOWN = 1e-11  # in the picture


class Case(NamedTuple):
    """A beam with one plane to bend in.

    equation  its characteristic equation;   bracket  of the first root
    tip       mass at its tip over its own;   hub  inertia of the hub over m L^2; None: clamped
    """

    equation: Callable[[float], float]
    bracket: tuple[float, float]
    tip: float = 0.0
    hub: float | None = None


CASES = {
    "clamped": Case(lambda x: 1.0 + cos(x) * cosh(x), (1.0, 2.5)),
    "clamped, its own mass on the tip": Case(
        lambda x: 1.0 + cos(x) * cosh(x) + x * (cos(x) * sinh(x) - sin(x) * cosh(x)), (0.5, 2.5), tip=1.0
    ),
    "on a hub of m L²": Case(
        lambda x: sin(x) * cosh(x) - cos(x) * sinh(x) + x**3 * (1.0 + cos(x) * cosh(x)), (1.5, 3.0), hub=1.0
    ),
}
METHODS: dict[str, Callable[[int], FlexibleBody]] = {
    "finite elements": lambda n: finite_elements(BEAM, [L], n),
    f"{OF_CRAIG_BAMPTON} elements, modes kept": lambda n: finite_elements(BEAM, [L], OF_CRAIG_BAMPTON, n),
    "assumed modes, clamped": lambda n: assumed_modes(BEAM, [L], n, "clamped"),
    "assumed modes, pinned": lambda n: assumed_modes(BEAM, [L], n, "pinned"),
}
LUMPED = "a lump at the tip"
COUNTS = (1, 2, 4, 8)


def first_root(case: Case) -> float:
    """x of the first bending, from the characteristic equation."""
    return float(brentq(case.equation, *case.bracket, xtol=1e-14))


def error(case: Case, body: FlexibleBody) -> float:
    """By how much a body's first frequency is too high, relative to the exact one."""
    M, K = body.mass.copy(), block_diag(np.zeros((6, 6)), body.stiffness)
    tip = np.hstack([np.eye(3), L * np.array([[0, 0, 0], [0, 0, 1], [0, -1, 0]]), body.displacement[-1]])
    M += case.tip * MASS * tip.T @ tip
    kept = list(range(6, len(M)))
    if case.hub is not None:
        M[TURN, TURN] += case.hub * MASS * L**2
        kept = [TURN, *kept]
    scale = EI / (MASS * L**3)
    # of 1/(w^2 + scale), of which the low frequencies are the largest, and lose no digits
    inverse = eigh(M[np.ix_(kept, kept)], (K + scale * M)[np.ix_(kept, kept)], eigvals_only=True)[::-1]
    squared = 1.0 / inverse[0 if case.hub is None else 1] - scale
    return float(np.sqrt(squared / scale) / first_root(case) ** 2 - 1.0)


def errors(counts: tuple[int, ...] = COUNTS) -> dict[tuple[str, str], list[float]]:
    """Error by case and method, for each number of elements or modes; that of the lump for none."""
    found = {
        (name, method): [error(case, make(n)) for n in counts]
        for name, case in CASES.items()
        for method, make in METHODS.items()
    }
    return found | {(name, LUMPED): [error(case, lumped_tip(BEAM, [L]))] for name, case in CASES.items()}


def order(few: float, many: float) -> float:
    """The power of their number with which errors fall, from one of half as many; nan where nothing is left."""
    return log2(few / many) if min(abs(few), abs(many)) > ROUNDING else float("nan")


def draw(made: Any) -> None:
    """Error of the first frequency over the number, of a beam on a hub and of one with a mass on its tip."""
    from zwidth.show import GREY, LINES, legend_above

    counts = (1, 2, 3, 4, 6, 8, 12, 16)
    found = errors(counts)
    panels = made.subplots(2, 1, sharex=True)
    names = ("on a hub of m L²", "clamped, its own mass on the tip")
    for ax, name in zip(panels, names, strict=True):
        for method, (colour, dashes), marker in zip(METHODS, LINES, "os^D", strict=False):
            values = np.abs(found[name, method])
            seen = values > ROUNDING
            style = {"color": colour, "linestyle": dashes, "marker": marker, "markersize": 4.0}
            ax.loglog(np.array(counts)[seen], values[seen], label=method, **style)
        ax.axhline(abs(found[name, LUMPED][0]), color=GREY, linewidth=1.8, label=LUMPED)
        ax.set_ylim(LEAST_SHOWN, 10.0)
        ax.set_ylabel("Relative error of frequency [1]")
        ax.text(0.02, 0.92, f"beam {name}", transform=ax.transAxes, fontsize=8.0)
    slope = np.array([3.0, 16.0])
    panels[0].loglog(slope, 4e-2 * slope**-4.0, color=GREY, linewidth=0.8)
    panels[0].text(8.0, 4e-2 * 7.0**-4.0, "n⁻⁴", fontsize=8.0, color=GREY, va="bottom")
    for ax in panels:
        ax.set_xticks(counts, labels=[str(n) for n in counts])
        ax.minorticks_off()
    panels[1].set_xlabel("Number n of elements or modes")
    legend_above(panels[0])


def rows() -> list[str]:
    """The table: relative errors by case and method, and the order from half of the largest number to that."""
    found, lines = errors(), []
    for case in CASES:
        for method in METHODS:
            values = found[case, method]
            power = order(values[-2], values[-1])
            cells = " | ".join(written(value) for value in values)
            lines.append(f"| {case} | {method} | {cells} | {'' if isnan(power) else f'{power:.1f}'} |")
        lines.append(f"| {case} | {LUMPED} | {written(found[case, LUMPED][0])} | | | | |")
    return lines


def written(value: float) -> str:
    """A relative error with two digits; 0 where it is rounding."""
    if abs(value) < ROUNDING:
        return "0"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa.replace('-', '−')}e{int(exponent)}"


if __name__ == "__main__":
    print("\n".join(rows()))
