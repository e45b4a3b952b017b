"""What the hand feels of one rendered wall: impedance over frequency, stiffness at rest, the chart over it.

On a measured device it follows frequency by frequency from the measured paths. A hand force f e^{jwt} moves the
encoder's samples by Y = G_eh f + P U, and the loop answers with U = -C Y, where C = K + B w(z), the force's filter
and software's delay included. At the frequency itself the handle moves by

    x_h = [G_hh - W G_ha C G_eh/(1 + P C)] f,        Z = f/(jw x_h)

with all that was measured, and W G_ha as `loop.measured.measured_port` gives it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from math import isfinite
from typing import Any, Final

import numpy as np
import shapely

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.chart.chart import StabilityChart, largest_stiffness
from zwidth.chart.chart_base import BoundaryArc, Chart
from zwidth.chart.verdict import judge
from zwidth.loop.controller import Controller
from zwidth.loop.factor_response import factor_response, window_response
from zwidth.loop.loop_table import force_filter, velocity_estimator
from zwidth.loop.measured.measured_port import MeasuredPort
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.handle_impedance import (
    LimitKind,
    check_no_local_loop,
    commanded_impedance,
    felt_impedance,
    free_impedance,
    free_motion_mass,
    handle_of,
    static_stiffness,
    static_stiffness_limit,
    static_stiffness_limit_kind,
)
from zwidth.model.argument_checks import check_kind, check_number
from zwidth.model.plant import Plant
from zwidth.result import Result, entry

LIMIT_HEADINGS: Final[dict[LimitKind, str]] = {
    "bound": "the structure itself has",
    "limit": "an infinitely stiff wall is felt with",
    "infinite": "an infinitely stiff wall is felt with",
    "unknown": "an infinitely stiff wall is felt with",
}
LIMIT_WORDS: Final[dict[LimitKind, str]] = {
    "infinite": "no limit: nothing gives way between sensor and handle",
    "unknown": "a stiffness that the measurement does not show",
}


@dataclass(frozen=True, repr=False)
class FeltWall(Result):
    """What the hand feels of one wall, of the device without the operator; k frequencies.

    wall_stiffness, wall_damping         [N/m], [N s/m]
    verdict                              of the wall, the device held by its operator: "stable", "unstable" or
                                         "undecided"
    static_stiffness                     felt at rest [N/m]; None where the wall is not stable
    free_motion_mass                     felt in slow free motion [kg]; nan where a spring ties the handle to the
                                         ground
    stiffness_max                        of the stiffest stable wall [N/m]; None: none has K > 0 and B >= 0
    static_stiffness_at_stiffness_max    felt stiffness of that wall [N/m]; None as before
    static_stiffness_limit               felt, of an infinitely stiff wall [N/m]; inf where nothing gives way
    static_stiffness_limit_kind          "bound": no wall is felt stiffer; "limit": walls of finite stiffness
                                         may be; "infinite"; "unknown": errors of a measurement hide it
    frequency                            (k,)  [Hz]
    felt_impedance                       (k,)  at the handle [N s/m]; None where the wall is not stable
    commanded_impedance                  (k,)  that of an ideal wall, B + K/(jw) [N s/m]
    free_motion_impedance                (k,)  at the handle without any wall, with the computer's fixed feedback
                                         [N s/m]
    """

    wall_stiffness: float = field(metadata=entry("N/m"))
    wall_damping: float = field(metadata=entry("N s/m"))
    verdict: str = field(metadata=entry())
    static_stiffness: float | None = field(metadata=entry("N/m"))
    free_motion_mass: float = field(metadata=entry("kg"))
    stiffness_max: float | None = field(metadata=entry("N/m"))
    static_stiffness_at_stiffness_max: float | None = field(metadata=entry("N/m"))
    static_stiffness_limit: float = field(metadata=entry("N/m"))
    static_stiffness_limit_kind: LimitKind = field(metadata=entry())
    frequency: Floats
    felt_impedance: Complexes | None
    commanded_impedance: Complexes
    free_motion_impedance: Complexes

    @property
    def reason(self) -> str | None:
        """Why there is no felt impedance; None where the wall is stable."""
        if self.verdict == "stable":
            return None
        return f"this wall is {self.verdict}, so that there is no steady motion to feel"

    def document(self) -> dict[str, Any]:
        """All numbers by key and unit; the felt ones are None where the wall is not stable."""
        own = super().document() | self.table()
        unknown = _impedance_columns("impedance", self.commanded_impedance) if self.felt_impedance is None else {}
        return own | dict.fromkeys(unknown)

    def table(self) -> dict[str, Floats]:
        """The impedances as columns, one frequency a row; nan for the felt one where the wall is not stable."""
        felt = (
            np.full(len(self.frequency), complex(np.nan, np.nan))
            if self.felt_impedance is None
            else self.felt_impedance
        )
        return {
            "frequency_Hz": self.frequency,
            **_impedance_columns("impedance", felt),
            **_impedance_columns("commanded", self.commanded_impedance),
            **_impedance_columns("free_motion", self.free_motion_impedance),
        }

    def __repr__(self) -> str:
        """Lines with the wall's verdict, what is felt at rest, of the stiffest wall and in free motion."""
        stiffest = "no stable wall has K > 0 and B >= 0"
        if self.stiffness_max is not None:
            felt = f"felt with {self.static_stiffness_at_stiffness_max:.4g} N/m"
            stiffest = f"stiffest stable wall {self.stiffness_max:.4g} N/m, {felt}"
        limit, kind = self.static_stiffness_limit, self.static_stiffness_limit_kind
        stiffest += f"; {LIMIT_HEADINGS[kind]} {LIMIT_WORDS.get(kind, f'{limit:.4g} N/m')}"
        low, high = self.frequency[0], self.frequency[-1]
        return "\n".join(
            [
                f"FeltWall: {self.wall_stiffness:.6g} N/m, {self.wall_damping:.6g} N s/m, {self.verdict}",
                f"  {self.reason or f'felt at rest with {self.static_stiffness:.4g} N/m'}",
                f"  {stiffest}",
                f"  free motion {self.free_motion_mass:.4g} kg",
                f"  impedances at {len(self.frequency)} frequencies from {low:.4g} to {high:.4g} Hz",
            ]
        )


def _impedance_columns(name: str, impedance: Complexes) -> dict[str, Floats]:
    """Real and imaginary part of an impedance (k,) [N s/m] as two columns."""
    return {f"{name}_real_Ns_per_m": impedance.real, f"{name}_imag_Ns_per_m": impedance.imag}


AT_REST: Final = 0.3  # of the lowest mode's frequency, up to which stiffness and mass at rest are read off
LOWEST_MODE: Final = 0.3  # of half the sampling rate, where no mode is lower
FEWEST: Final = 8  # frequencies from which they are
CLEAR: Final = 0.1  # relative deviation of a motion, beyond which its inverse is biased
UNCERTAIN: Final = 0.25  # relative standard deviation of a number at rest that is not given any more
UNYIELDING: Final = 1e6  # times the device's largest dynamic stiffness: a wall of that many N/m holds the encoder


def felt_wall_of_response(point: OperatingPoint, stiffness: float, damping: float) -> FeltWall:
    """What the hand feels of a wall on a measured device, at the measured frequencies; see `felt_wall`.

    Felt stiffness and mass at rest are those that the frequencies well below the lowest mode show; nan where their
    errors hide them.

    Raises  ResponseError  where the paths of the handle were not measured
    """
    port, controller = point.measured_port, point.controller
    chart: Chart = point.chart()
    verdict = str(np.ravel(chart.check(stiffness, damping).names)[0])
    stable, peak = verdict == "stable", chart.stiffness_max
    inner = _known_frequencies(port)
    theta = port.theta[inner]
    frequency = theta / (2.0 * np.pi * port.period)
    jw = 2j * np.pi * frequency
    force, speed = _computer_responses(controller, theta)
    paths = {name: value[inner] for name, value in port.baseband.items()} | {"P": port.sampled["sa"][inner]}
    deviations = {source: deviation[inner] for source, deviation in port.deviations.items()}
    modes = port.model.modes[:, 0]
    lowest = min([*modes[modes > 0.0], LOWEST_MODE * np.pi])
    low = slice(0, max(FEWEST, int(np.searchsorted(theta, AT_REST * lowest))))
    # stiffness and mass felt with a wall of a response
    at_rest = partial(_felt_at_rest, port, theta, low, paths, deviations)
    # encoder and handle are one place where both paths are one measurement
    rigid = port.origin["hh"] == port.origin["sh"]
    spring = not (port.model.free or np.any(modes == 0.0))
    unyielding = UNYIELDING * float(np.max(np.abs(1.0 / paths["P"])))
    limit = np.inf if rigid else at_rest(unyielding * force)[0]
    free = 1.0 / (jw * paths["hh"])
    return FeltWall(
        wall_stiffness=stiffness,
        wall_damping=damping,
        verdict=verdict,
        static_stiffness=at_rest(stiffness * force)[0] if stable else None,
        free_motion_mass=np.nan if spring else at_rest(0.0 * force)[1],
        stiffness_max=peak if np.isfinite(peak) else None,
        static_stiffness_at_stiffness_max=at_rest(peak * force)[0] if np.isfinite(peak) else None,
        static_stiffness_limit=limit,
        static_stiffness_limit_kind="infinite" if rigid else "unknown" if np.isnan(limit) else "limit",
        frequency=frequency,
        felt_impedance=1.0 / (jw * _handle_motion(paths, force * (stiffness + damping * speed)))
        if stable
        else None,
        commanded_impedance=commanded_impedance(stiffness, damping, frequency),
        free_motion_impedance=free,
    )


def _known_frequencies(port: MeasuredPort) -> Flags:
    """Return which frequencies (n,) lie below half the sampling rate and have a finite error in every path."""
    inner = port.theta < np.pi * (1.0 - 1e-9)
    for source in set(port.origin.values()):
        inner &= np.isfinite(port.deviations[source])
    return inner


def _felt_at_rest(
    port: MeasuredPort,
    theta: Floats,
    low: slice,
    paths: dict[str, Complexes],
    deviations: dict[str, Floats],
    law: Complexes,
) -> tuple[float, float]:
    """Return stiffness [N/m] and mass [kg] felt at rest with a wall of this response (k,); nan where errors hide
    them.

    theta  (k,)  omega T [rad];   low  those well below the lowest mode
    paths, deviations  measured responses (k,) by name, such as "hh" of handle per hand force, and their errors
    """
    spread = _motion_deviation(port, paths, deviations, law)
    return _stiffness_and_mass(theta[low] / port.period, _handle_motion(paths, law)[low], spread[low])


def _computer_responses(controller: Controller, theta: Floats) -> tuple[Complexes, Complexes]:
    """Responses (k,) of force filter with software's delay, and of velocity estimate [1/s].

    theta  (k,)  angles omega T [rad]
    """
    z, d = np.exp(1j * theta), np.expm1(1j * theta)
    force, speed = force_filter(controller), velocity_estimator(controller)
    # software's delay, whole samples but for rounding
    passed = factor_response(force.numerator, force.denominator, d) * z ** -round(controller.delay)
    estimate = factor_response(speed.numerator, speed.denominator, d) * window_response(speed.window, z)
    return np.asarray(passed), np.asarray(estimate)


def _handle_motion(paths: dict[str, Complexes], law: Complexes) -> Complexes:
    """Handle motion per hand force, x_h/f (k,) [m/N], with a wall of response `law` (k,) [N/m]."""
    return np.asarray(paths["hh"] - paths["ha"] * law * paths["sh"] / (1.0 + paths["P"] * law))


def _motion_deviation(
    port: MeasuredPort, paths: dict[str, Complexes], deviations: dict[str, Floats], law: Complexes
) -> Floats:
    """Standard deviation (k,) of `_handle_motion` [m/N], the errors of different measurements independent.

    paths, deviations  measured responses by name, and their standard deviations (k,);   law  of the wall [N/m]
    """
    answer = law / (1.0 + paths["P"] * law)
    # derivatives of the handle's motion by each path
    slopes = {"hh": 1.0 + 0.0 * law, "sh": -paths["ha"] * answer, "ha": -answer * paths["sh"]}
    slopes["sa"] = paths["ha"] * paths["sh"] * answer**2
    by_source: dict[str, Complexes] = {}
    # paths of one measurement share its error, so that their derivatives add up
    for name, slope in slopes.items():
        source = port.origin[name]
        # a path that is taken from another one has that measurement's error, as a share of its size
        scale = np.abs(paths[name]) / np.maximum(np.abs(paths[source]), 1e-300) if name != source else 1.0
        by_source[source] = by_source.get(source, 0.0 * law) + slope * scale
    return np.asarray(np.sqrt(sum((np.abs(s) * deviations[name]) ** 2 for name, s in by_source.items())))


def _stiffness_and_mass(omega: Floats, motion: Complexes, deviation: Floats) -> tuple[float, float]:
    """k [N/m] and m [kg] of  Re S = k - m w^2 + c w^4,  S = 1/motion the dynamic stiffness at low w; nan for what
    is uncertain by more than UNCERTAIN of it, and for both where fewer than FEWEST motions are CLEAR.

    omega      (k,)  w [rad/s], ascending
    motion     (k,)  of the handle per newton of the hand [m/N]
    deviation  (k,)  standard deviation of the motion; where one is 0 none is known: all motions count alike
    """
    clear = deviation < CLEAR * np.abs(motion)
    if np.count_nonzero(clear) < FEWEST:
        return np.nan, np.nan
    omega, motion, deviation = omega[clear], motion[clear], deviation[clear]
    square = (omega / omega[-1]) ** 2  # in these units: k, m w_last^2 and c w_last^4 are of one size
    columns = np.vander(square, 3, increasing=True)
    known = bool(np.all(deviation > 0.0))
    # of S = 1/motion the standard deviation is deviation/|motion|^2
    weight = np.abs(motion) ** 2 / deviation if known else np.ones(len(square))
    solution = np.linalg.lstsq(columns * weight[:, None], np.real(1.0 / motion) * weight, rcond=None)[0]
    spread = np.zeros(3)
    if known:
        spread = np.sqrt(np.diag(np.linalg.pinv((columns * weight[:, None]).T @ (columns * weight[:, None]))))
    values = np.where(spread < UNCERTAIN * np.abs(solution), solution, np.nan)
    return float(values[0]), float(-values[1] / omega[-1] ** 2)


COUNT: Final = 400  # frequencies, from LOWEST of half the sampling frequency up to HIGHEST of it
LOWEST, HIGHEST = 1e-3, 0.999


def felt_wall(point: OperatingPoint, stiffness: float, damping: float) -> FeltWall:
    """What the hand feels of a wall.

    point               the device; stability includes its operator, the felt impedance does not
    stiffness, damping  of the wall [N/m], [N s/m]
    Raises  HandleError  (measures.handle_impedance) where there is no handle
            ValueError   for a wall that is not finite
            what `OperatingPoint.plant` and `chart.chart.largest_stiffness` raise
            ResponseError  of a measured device, as `felt_wall_of_response`

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> link, motor, hand = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([0.0, 1.0]), np.array([1.0, 0.0])
    >>> pair = Plant(np.diag([0.2616, 0.0254]), 1.8744 * link, 15620.0 * link, motor, motor, hand)
    >>> felt_wall(OperatingPoint(Controller(0.00125), given_plant=pair), 4000.0, 10.0)
    FeltWall: 4000 N/m, 10 N s/m, stable
      felt at rest with 3185 N/m
      stiffest stable wall 7134 N/m, felt with 4897 N/m; the structure itself has 1.562e+04 N/m
      free motion 0.287 kg
      impedances at 400 frequencies from 0.4 to 399.6 Hz
    """
    check_kind("point", point, OperatingPoint)
    check_number("stiffness", stiffness, "N/m")
    check_number("damping", damping, "N s/m")
    if point.response is not None:
        return felt_wall_of_response(point, stiffness, damping)
    plant, K, B = point.ungripped_plant, stiffness, damping
    handle_of(plant)
    verdict = judge(point.loop, [K], [B]).names[0]
    peak = largest_stiffness(point.loop)
    loop = point.without_operator.loop
    computer = loop.controller
    check_no_local_loop(computer)
    frequency = np.geomspace(LOWEST, HIGHEST, COUNT) * 0.5 / loop.period
    stable = verdict == "stable"
    return FeltWall(
        wall_stiffness=K,
        wall_damping=B,
        verdict=verdict,
        static_stiffness=float(static_stiffness(plant, K, computer)) if stable else None,
        free_motion_mass=free_motion_mass(plant, computer),
        stiffness_max=peak.stiffness if peak else None,
        static_stiffness_at_stiffness_max=float(static_stiffness(plant, peak.stiffness, computer))
        if peak
        else None,
        static_stiffness_limit=static_stiffness_limit(plant),
        static_stiffness_limit_kind=static_stiffness_limit_kind(plant, computer),
        frequency=frequency,
        felt_impedance=felt_impedance(loop, K, B, frequency) if stable else None,
        commanded_impedance=commanded_impedance(K, B, frequency),
        free_motion_impedance=free_impedance(loop, frequency),
    )


# A straight side of the chart becomes a curve; it is cut into pieces of this share of the largest stiffness first.
PIECE = 1e-3


def _felt_arcs(arcs: tuple[BoundaryArc, ...]) -> list[dict[str, Floats]]:
    """Arcs of a boundary by key and unit, where their stiffness is the felt one."""
    return [
        {"felt_stiffness_N_per_m": arc.stiffness, "damping_Ns_per_m": arc.damping, "frequency_Hz": arc.frequency}
        for arc in arcs
    ]


@dataclass(frozen=True, repr=False)
class FeltChart(Result):
    """The stable walls with K >= 0, each at the stiffness that the hand feels at rest.

    regions        closed rings (k, 2) of [felt stiffness, wall damping], counter-clockwise
    boundary       the arcs of the stable set's edge with K >= 0; `stiffness` is the felt one
    stiffness_max  felt stiffness of the stiffest stable wall with B >= 0 [N/m]; nan if there is none
    limit          felt stiffness of an infinitely stiff wall [N/m]; inf where nothing gives way
    limit_kind     "bound": no wall is felt stiffer; "limit": walls of finite stiffness may be; "infinite"
    """

    regions: tuple[Floats, ...] = field(metadata=entry(lists=True))
    boundary: tuple[BoundaryArc, ...] = field(metadata=entry(value=_felt_arcs))
    stiffness_max: float = field(metadata=entry("N/m", name="felt_stiffness_max"))
    limit: float = field(metadata=entry("N/m", name="felt_stiffness_limit"))
    limit_kind: LimitKind = field(metadata=entry(name="felt_stiffness_limit_kind"))

    def table(self) -> dict[str, Floats]:
        """The edge's walls as columns, its arcs one after another and counted from 0."""
        empty = np.zeros(0)
        return {
            "arc": np.repeat(np.arange(len(self.boundary)), [len(arc.stiffness) for arc in self.boundary]),
            "felt_stiffness_N_per_m": np.concatenate([empty, *(arc.stiffness for arc in self.boundary)]),
            "damping_Ns_per_m": np.concatenate([empty, *(arc.damping for arc in self.boundary)]),
            "frequency_Hz": np.concatenate([empty, *(arc.frequency for arc in self.boundary)]),
        }

    def __repr__(self) -> str:
        """One line with the felt stiffness of the stiffest stable wall and its limit [N/m]."""
        hardest = (
            f"hardest felt contact {self.stiffness_max:.6g} N/m"
            if isfinite(self.stiffness_max)
            else "no stable wall"
        )
        limit = f", {LIMIT_HEADINGS[self.limit_kind]} {self.limit:.6g} N/m" if isfinite(self.limit) else ""
        return f"FeltChart: {hardest}{limit}"


def felt_chart(chart: StabilityChart, device: Plant | None = None) -> FeltChart:
    """A chart in felt static stiffness (see `handle_impedance.static_stiffness`), for walls with K >= 0 of either
    sign of B.

    device  what the hand holds, without the hand; left out: the chart's own plant, which then has no operator

    Walls of negative stiffness are left out: at K = -k a spring k in series has no finite felt stiffness.

    Raises  HandleError  where the plant has no handle
    """
    check_kind("chart", chart, StabilityChart)
    plant = device or chart.loop.plant
    walls = np.vstack(chart.regions) if chart.regions else np.zeros((1, 2))
    # least and largest damping, and largest stiffness
    (_, low), (right, high) = walls.min(axis=0), walls.max(axis=0)
    computer = chart.loop.controller
    # K >= 0 as far as the regions reach
    half_plane = shapely.box(0.0, low - 1.0, max(right, 0.0) + 1.0, high + 1.0)
    rings = []
    for region in chart.regions:
        cut = shapely.intersection(shapely.Polygon(region), half_plane)
        for part in shapely.get_parts(cut):
            if isinstance(part, shapely.Polygon) and part.area > 0.0:
                ring = np.array(
                    shapely.segmentize(part, PIECE * float(np.hypot(right, high - low))).exterior.coords
                )
                ring[:, 0] = static_stiffness(plant, np.maximum(ring[:, 0], 0.0), computer)
                rings.append(ring if shapely.LinearRing(ring).is_ccw else ring[::-1])
    arcs = []
    for arc in chart.boundary:
        for run in _true_runs(arc.stiffness >= 0.0):
            stiffness = static_stiffness(plant, arc.stiffness[run], computer)
            arcs.append(BoundaryArc(stiffness, arc.damping[run], arc.frequency[run]))
    felt = FeltChart(
        regions=tuple(rings),
        boundary=tuple(arcs),
        stiffness_max=float(static_stiffness(plant, chart.stiffness_max, computer))
        if chart.stiffness_max > 0.0
        else float("nan"),
        limit=static_stiffness_limit(plant),
        limit_kind=static_stiffness_limit_kind(plant, computer),
    )
    return felt if chart.operating_point is None else felt.about(chart.operating_point)


def _true_runs(inside: Flags) -> list[slice]:
    """Slices of `inside` (k,) that hold a run of at least two True values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]])))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1]
