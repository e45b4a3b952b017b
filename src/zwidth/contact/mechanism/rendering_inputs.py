"""Environment, surface and drives of a rendering as numbers for the kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.model.mechanism import Drives


class RenderingInputs(NamedTuple):
    """The environment at the surface, and the drives as the computer counts and commands them.

    surface            as `surfaces.packed` gives it
    address            where the environment's machine code begins;   values (P,)  of its parameters
    encoder_coordinates  (d,)      coordinates that the encoders read
    step                 (d,)      one count [rad at the joint]; 0: as fine as you like
    noise                (d,)      standard deviation of what is added before counting [rad at the joint];   seed
                         of the noise
    limit                (d,)      largest torques at the joints [N m]
    together           True: all torques are scaled alike where one is at its limit
    """

    surface: Floats
    address: int
    values: Floats
    encoder_coordinates: Ints
    step: Floats
    noise: Floats
    seed: np.uint64
    limit: Floats
    together: bool


def rendering_inputs(
    drives: Drives,
    surface: Floats,
    address: int,
    values: Floats,
    read: Ints,
    counted: bool,
    seed: int,
    together: bool,
) -> RenderingInputs:
    """The law at a surface.

    counted  False: encoders without steps and noise
    """
    n, counts, parts = drives.transmission, drives.encoder_counts, drives.nonlinearity
    known = np.isfinite(counts) & counted
    return RenderingInputs(
        surface=surface,
        address=address,
        values=values,
        encoder_coordinates=np.array(read, dtype=np.int64),
        step=np.where(known, 2.0 * np.pi / np.where(known, counts * n, 1.0), 0.0),
        noise=np.zeros(len(n)) if parts is None or not counted else np.array(parts.encoder_noise / n),
        seed=np.uint64(seed),
        limit=np.array(n * drives.torque_limit),
        together=together,
    )
