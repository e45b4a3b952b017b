"""The wall law as numbers for the kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.contact.velocity import velocity_estimate
from zwidth.loop.controller import Controller
from zwidth.loop.filters import force_filter
from zwidth.model.mechanism import Drives, Floats, Ints


class Law(NamedTuple):
    """What the computer does with the counts.

    surface            as `surfaces.packed` gives it
    stiffness, damping of the wall along its normal [N/m], [N s/m];   no_pull: it never pulls
    read     (d,)      coordinates that the encoders read
    quantum  (d,)      one count [rad at the joint]; 0: as fine as you like
    period             T [s]
    method, parameters the velocity estimate of each coordinate: see `contact.velocity`
    memory             numbers that it remembers
    window, numerator, denominator   of a linear one and of the velocity's filter, as in `loop.estimator`
    force_numerator, force_denominator   of the force's filter
    saturation         largest force [N];   limit (d,)  largest torques at the joints [N m]
    together           True: all torques are scaled alike where one is at its limit
    whole              samples of delay
    """

    surface: Floats
    stiffness: float
    damping: float
    no_pull: bool
    read: Ints
    quantum: Floats
    period: float
    method: int
    parameters: Floats
    memory: int
    window: Floats
    numerator: Floats
    denominator: Floats
    force_numerator: Floats
    force_denominator: Floats
    saturation: float
    limit: Floats
    together: bool
    whole: int


def law_of(
    drives: Drives,
    controller: Controller,
    surface: Floats,
    gains: tuple[float, float, bool],
    read: Ints,
    counted: bool,
    together: bool,
) -> Law:
    """The law of a controller; gains are the wall's stiffness and damping and whether it must not pull."""
    n, counts = drives.transmission, drives.encoder_counts
    known = np.isfinite(counts) & counted
    velocity, passed = velocity_estimate(controller), force_filter(controller)
    return Law(
        surface=surface,
        stiffness=gains[0],
        damping=gains[1],
        no_pull=gains[2],
        read=np.array(read, dtype=np.int64),
        quantum=np.where(known, 2.0 * np.pi / np.where(known, counts * n, 1.0), 0.0),
        period=float(controller.sampling_period),
        method=velocity.method,
        parameters=velocity.tuning,
        memory=velocity.memory,
        window=velocity.linear.window,
        numerator=velocity.linear.numerator,
        denominator=velocity.linear.denominator,
        force_numerator=passed.numerator,
        force_denominator=passed.denominator,
        saturation=float(controller.saturation),
        limit=np.array(n * drives.torque_limit),
        together=together,
        whole=controller.whole_delay,
    )
