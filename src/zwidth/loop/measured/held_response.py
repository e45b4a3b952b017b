"""A measured device in an operator's hand, as another measured device.

He pushes the handle with -D(jw) x_h, D the dynamic stiffness of arm and grasp. Before sampling the device answers
a command with G_ea - X/W, and after it with

    P' = P - sum_k X_k,      X = G_eh D/(1 + D G_hh) G_ha W

X_0 is made of the data; what looks like it at the frequencies beyond half the sampling rate, of the fitted modes
of the device. It falls like 1/w^3 with a rigid grasp, like 1/w^4 and more with an elastic one, and is small where
the device is heavier than what the hand adds at high frequency.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.polynomial import chebyshev

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.errors import OperatorError
from zwidth.loop.measured.measured_port import MeasuredPort, measured_port
from zwidth.model.operator import Operator
from zwidth.model.response import Response

NODES: Final = 16  # angles at which the aliases beyond the nearest are summed; they vary little
FAR: Final = 1500  # aliases to either side
MOST_ERROR: Final = 0.2  # relative standard deviation of a held response's value, from which it is left out
FEWEST: Final = 50  # frequencies that must be left
ALIKE: Final = 0.9  # of half the sampling rate: at it, a frequency and its mirror image are one


def operator_stiffness(operator: Operator, omega: Floats) -> Complexes:
    """D (...) = -f/x_h of arm and grasp at angular frequencies [rad/s], of either sign [N/m].

    arm  k_a + jw b_a - w^2 m_a,   grasp  k_g + jw b_g,   both in series unless the grasp is rigid
    """
    s = 1j * np.asarray(omega, dtype=float)
    arm = operator.arm_stiffness + s * operator.arm_damping + s**2 * operator.arm_mass
    if operator.grasp_stiffness is None:
        return np.asarray(arm)
    grasp = operator.grasp_stiffness + s * (operator.grasp_damping or 0.0)
    return np.asarray(arm * grasp / (arm + grasp))


def held_response(response: Response, operator: Operator, period: float) -> Response:
    """The response of a device with an operator at its handle.

    His own numbers count as known. Repeated sweeps are held one by one; from coherence the error of every path is
    carried on, with that of the fitted modes in what they add.

    period  sampling period T [s]
    Raises  ResponseError  where the handle was not measured, see `measured_port`
            OperatorError  as `hold_port`
    """
    _check_mass(operator)
    return hold_port(response, measured_port(response, period), operator)


def hold_port(response: Response, port: MeasuredPort, operator: Operator) -> Response:
    """The response with an operator at the handle, of a device whose port is known already, at the frequencies at
    which errors leave something of it, or at all of them where these are too few. Raises OperatorError for an arm
    without mass behind an elastic grasp."""
    _check_mass(operator)
    D = operator_stiffness(operator, port.theta / port.period)
    beyond = _aliases(port, operator)
    change = _hand_change(port.baseband, D)
    held = response.value - change - beyond
    sweeps = None
    if port.sweeps:
        sweeps = np.array([value - _hand_change(base, D) - beyond for base, value in port.sweeps])
    error = _relative_error(port, D, change, held, beyond)
    # what a hand leaves of a far larger motion is the difference of two measured ones; all are kept where fewer
    # than FEWEST would be left
    kept = (
        error < MOST_ERROR if np.count_nonzero(error < MOST_ERROR) >= FEWEST else np.ones(len(error), dtype=bool)
    )
    # the coherence that would tell this error, `model.response.relative_error` solved for it
    coherence = 1.0 / (1.0 + 2.0 * response.averages * error**2) if port.errors_known else None
    return replace(
        response,
        frequency=response.frequency[kept],
        value=held[kept],
        # an arm's spring or damper takes poles at z = 1 away, below the data or within: read off anew
        integrators=response.integrators if not (operator.arm_stiffness or operator.arm_damping) else None,
        coherence=None if coherence is None else coherence[kept],
        freedom=None if response.freedom is None else response.freedom[kept],
        sweeps=None if sweeps is None else sweeps[:, kept],
        note=_note(response, port, np.abs(beyond / held), kept),
        handle=None,
        delay=None,
    )


def response_of_port(response: Response, port: MeasuredPort, operator: Operator | None) -> Response:
    """The response up to half the sampling rate of a port that was changed, see `measured_port.changed_port`, with
    or without an operator.

    response  the measured one, whose coherence stays without an operator
    """
    whole = replace(
        response,
        frequency=port.theta / (2.0 * np.pi * port.period),
        value=port.sampled["sa"],
        sweeps=np.array([value for _, value in port.sweeps]) if port.sweeps else None,
    )
    held = whole if operator is None else hold_port(whole, port, operator)
    good = held.frequency * port.period <= 0.5 * (1.0 + 1e-9)
    coherence, sweeps = held.coherence, held.sweeps
    return replace(
        held,
        frequency=held.frequency[good],
        value=held.value[good],
        coherence=None if coherence is None else coherence[good],
        freedom=None if held.freedom is None else held.freedom[good],
        sweeps=None if sweeps is None else sweeps[:, good],
        handle=None,
    )


def _check_mass(operator: Operator) -> None:
    """Raise OperatorError for an arm without mass behind an elastic grasp."""
    if not operator.rigid_grasp and not operator.arm_mass > 0.0:
        raise OperatorError(f"an arm held by an elastic grasp needs a mass, got {operator.arm_mass:g} kg")


def _note(response: Response, port: MeasuredPort, share: Floats, kept: Flags) -> str:
    """How the held response was made, in words. share (n,) of the aliases in it; kept (n,) which frequencies stay
    in it."""
    below = kept & (port.theta < ALIKE * np.pi)
    worst = int(np.argmax(np.where(below, share, 0.0)))
    parts = [response.note] if response.note else []
    parts.append(
        f"held by the operator, {len(port.model.modes) + port.model.free} fitted modes continuing the device "
        f"beyond half the sampling rate: they make up at most {100.0 * share[worst]:.2g} % of the response, at "
        f"{response.frequency[worst]:.4g} Hz, and miss the upper half of what was measured by "
        f"{100.0 * port.misfit:.2g} %"
    )
    if not kept.all():
        lost = response.frequency[~kept]
        parts.append(
            f"{len(lost)} frequencies from {lost[0]:.4g} to {lost[-1]:.4g} Hz left out, where errors of the paths "
            f"make up more than {100.0 * MOST_ERROR:.0f} % of what the hand leaves of the motion"
        )
    return "; ".join(parts)


def _hand_change(base: Mapping[str, Complexes], D: Complexes) -> Complexes:
    """X (...), what a hand of stiffness D (...) [N/m] takes off the response.

    base  paths (...) by their names of `MeasuredPort`: "sh" to the sensor from the hand's force, "hh" to the
          handle from it, "ha" to the handle from the command
    """
    return np.asarray(base["sh"] * D / (1.0 + D * base["hh"]) * base["ha"])


def _aliases(port: MeasuredPort, operator: Operator) -> Complexes:
    """Sum (n,) of X, what the hand takes off the response, over the frequencies theta + 2 pi k, k other than 0, to
    FAR on either side, of the fitted modes."""

    def change(theta: Floats) -> Complexes:
        """X (...) [m/N] of the fitted modes at angles (...) of any size, in radians per sample."""
        flat = theta.ravel()
        D = operator_stiffness(operator, flat / port.period)
        path = {name: port.continued(name, flat) for name in ("sh", "ha", "hh")}
        path["ha"] = path["ha"] * port.model.hold(flat)
        return _hand_change(path, D).reshape(theta.shape)

    # the nearest alias to either side is computed at each angle, the sum of the others as a Chebyshev series
    k = np.arange(2, FAR + 1)
    nodes = 0.5 * np.pi * (1.0 + chebyshev.chebpts1(NODES))
    turns = 2.0 * np.pi * np.concatenate([k, -k])
    far = change(nodes[:, None] + turns).sum(axis=1)
    series = np.linalg.solve(chebyshev.chebvander(chebyshev.chebpts1(NODES), NODES - 1), far)
    smooth = chebyshev.chebvander(2.0 * port.theta / np.pi - 1.0, NODES - 1) @ series
    return np.asarray(change(port.theta + 2.0 * np.pi) + change(port.theta - 2.0 * np.pi) + smooth)


def _relative_error(
    port: MeasuredPort, D: Complexes, change: Complexes, held: Complexes, beyond: Complexes
) -> Floats:
    """Relative standard deviation (n,) of a held response of a port; 0 where no error of the paths is known.

    change, held, beyond  (n,) X, the held response, and the aliases in it;   D  (n,) [N/m] of the hand

        dX/X = dG_eh/G_eh + d(W G_ha)/(W G_ha) - D G_hh/(1 + D G_hh) dG_hh/G_hh

    where paths that stem from one measurement err together.
    """
    base, hold = port.baseband, port.model.hold(port.theta)
    one = np.ones(len(held), dtype=complex)
    parts: dict[str, Complexes] = {"sh": one, "ha": one, "hh": -D * base["hh"] / (1.0 + D * base["hh"])}
    slopes: dict[str, Complexes] = {"sa": one}
    for name, factor in parts.items():
        source = port.origin[name]
        path = base[name]
        if name[1] != source[1]:  # a path from the hand's force that stems from one of commands, or vice versa
            path = path * hold if source[1] == "a" else path / hold
        slopes[source] = slopes.get(source, 0.0 * one) - change * factor / path
    # slopes: of the held response by each measured path
    square = np.zeros(len(held))
    if port.errors_known:
        square += (port.misfit * np.abs(beyond)) ** 2
    for source, slope in slopes.items():
        square += (np.abs(slope) * port.deviations[source]) ** 2
    return np.asarray(np.sqrt(square) / np.maximum(np.abs(held), 1e-300))
