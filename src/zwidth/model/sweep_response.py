"""From a raw sweep, samples of commanded force and encoder position, to a response with coherence."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.model.response import Response, ResponseError

Floats = NDArray[np.float64]

SHORTEST_SEGMENT = 64  # samples
SEGMENTS = 8  # into which a record is cut where nothing is said, half of each shared with the next
OVERLAP_KEPT = 1.0 + 2.0 / 36.0  # Hann windows that share a half: variance as of so many times fewer segments
EXCITED = 1e-7  # power of the force, over its largest, below which a frequency was not excited


def sweep_response(
    force: Floats, position: Floats, period: float, integrators: int | None = None, segment: int | None = None
) -> Response:
    """The response P of a sampled record by averaged cross-spectra, P = S_fy / S_ff, and its coherence.

    Welch's method (Welch 1967): Hann windows of `segment` samples that overlap by half. A device without a spring
    drifts, and what it drifts leaks into every frequency; so the position is differenced first, once for each
    integrator (twice where their number is not known), and the spectrum divided by (z - 1)^m again. The coherence
    is that of the differenced position.

    force, position  (n,) [N], [m], one sample per period; position[j] is read when force[j] is sent
    integrators      poles at z = 1: 0, 1 or 2; None: not known
    segment          samples in a segment; None: the power of two that makes about 15 of them
    Raises           ResponseError  where the record is shorter than two segments, or the force is constant

    >>> rng = np.random.default_rng(1)
    >>> force = rng.normal(size=20_000)
    >>> position = np.concatenate([[0.0], np.cumsum(force)[:-1]])       # P = 1 / (z - 1)
    >>> found = sweep_response(force, position, period=0.001, integrators=1)
    >>> z = np.exp(2j * np.pi * found.frequency * 0.001)
    >>> float(np.max(np.abs(found.value * (z - 1.0) - 1.0))) < 1e-9
    True
    """
    from scipy.signal import csd, welch

    m = 2 if integrators is None else integrators
    length = segment or 2 ** int(np.log2(max(len(force) / SEGMENTS, 1.0)))
    if length < SHORTEST_SEGMENT or len(force) < 2 * length + m:
        raise ResponseError(
            f"has {len(force)} samples, too few for two segments of {max(length, SHORTEST_SEGMENT)}; record "
            f"longer, or set segment_samples (at least {SHORTEST_SEGMENT})"
        )
    if np.ptp(force) == 0.0:
        raise ResponseError(f"the commanded force is {force[0]:g} N all the time; excite the device")
    differences = np.diff(position, n=m)
    force_samples = force[: len(differences)]
    settings = {"fs": 1.0 / period, "window": "hann", "nperseg": length, "noverlap": length // 2}
    f, cross = csd(force_samples, differences, **settings)
    _, of_force = welch(force_samples, **settings)
    _, of_moved = welch(differences, **settings)
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = np.abs(cross) ** 2 / (of_force * of_moved)
        value = cross / of_force / (np.exp(2j * np.pi * f * period) - 1.0) ** m
    excited = (of_force > EXCITED * np.max(of_force)) & np.isfinite(coherence)
    count = 1 + (len(force_samples) - length) // (length - length // 2)
    usable = slice(2, None)  # the window mixes the mean into the first frequency
    return Response(
        frequency=f[usable],
        value=np.where(np.isfinite(value), value, 0.0)[usable],
        integrators=integrators,
        coherence=np.where(excited, np.clip(coherence, 0.0, 1.0), 0.0)[usable],
        averages=count / OVERLAP_KEPT,
        note=f"from {len(force)} samples by {count} Hann segments of {length}",
    )
