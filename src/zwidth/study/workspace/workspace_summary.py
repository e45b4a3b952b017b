"""Summary of a map: averages and extremes over the workspace."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.device import Device
from zwidth.measures.overall import global_conditioning_index, global_isotropy_index, overall

if TYPE_CHECKING:
    import xarray as xr

# Condition numbers, of which Gosselin and Angeles average the reciprocals.
CONDITIONS: Final = ("isotropy", "isotropy_frobenius", "dynamic_isotropy", "handle_mass_isotropy")


def over_the_workspace(dataset: xr.Dataset, name: str, device: Device | None = None) -> dict[str, float]:
    """Average, worst, best, uniformity and so on of one measure of a map (`measures.overall.Overall`).

    Averages are integrals by the trapezoidal rule: points on the rim of the grid stand for half as much. Condition
    numbers have Gosselin and Angeles's `conditioning_index`, and `isotropy` Stocco's `isotropy_index`, for which
    the device's postures are solved again; without a device it is left out.
    """
    values, status = dataset[name].values, dataset[f"{name}_status"].values
    weights = areas(dataset["x_m"].values, dataset["y_m"].values)
    better = dataset[name].attrs["better"] or None
    summary = dict(vars(overall(values, status, weights, better)))
    if name in CONDITIONS:
        summary["conditioning_index"] = global_conditioning_index(values, status, weights)
    if name == "isotropy" and device is not None and device.mechanism is not None:
        from zwidth.model.posture import solve_posture

        posture = solve_posture(device.mechanism, positions(dataset), dataset.attrs["assembly"])
        freedoms = len(device.mechanism.drives.names)
        summary["isotropy_index"] = global_isotropy_index(posture.jacobian, status, freedoms)
    return summary


def positions(dataset: xr.Dataset) -> Floats:
    """Handle positions (ny, nx, 3) of a map's cells in the base frame [m]."""
    axes = np.asarray(dataset.attrs["plane_axes"], dtype=np.float64).reshape(2, 3)
    through = np.asarray(dataset.attrs["plane_through_m"], dtype=np.float64)
    x, y = dataset["x_m"].values, dataset["y_m"].values
    return np.asarray(through + x[None, :, None] * axes[0] + y[:, None, None] * axes[1])


def areas(x: Floats, y: Floats) -> Floats:
    """Area [m^2] that belongs to each point (ny, nx) of a grid by the trapezoidal rule.

    >>> areas(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0])).tolist()
    [[0.5, 1.0, 0.5], [0.5, 1.0, 0.5]]
    """
    return np.outer(_trapezoids(y), _trapezoids(x))


def _trapezoids(x: Floats) -> Floats:
    step = np.diff(x)
    return np.asarray(0.5 * (np.append(step, 0.0) + np.append(0.0, step)))
