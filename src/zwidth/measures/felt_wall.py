"""What the hand feels of one rendered wall: impedance over frequency, and stiffness at rest."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.chart.chart import largest_stiffness
from zwidth.chart.verdict import judge
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.felt import FeltWall
from zwidth.measures.felt_measured import felt_wall_of_response
from zwidth.measures.handle_impedance import (
    commanded_impedance,
    felt_impedance,
    free_impedance,
    free_motion_mass,
    handle_of,
    refuse_local_loop,
    static_stiffness,
    static_stiffness_limit,
    static_stiffness_limit_kind,
)
from zwidth.model.argument_checks import check_number, require

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
      stiffest stable wall 7134 N/m, felt with 4897 N/m; no wall is felt above 1.562e+04 N/m
      free motion 0.287 kg
      impedances at 400 frequencies from 0.4 to 399.6 Hz
    """
    require("point", point, OperatingPoint)
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
    refuse_local_loop(computer)
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
