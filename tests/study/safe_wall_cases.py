"""Random devices whose safe walls are tabled, and walls of a table tried by eigenvalues."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass

import numpy as np

from zwidth.chart.table_radii import radii_at_points
from zwidth.device import from_document, new_device
from zwidth.measures import OK


def random_device(kind, seed):
    """A device of a kind of `zwidth new`, with its numbers drawn: lengths by up to 1.1, masses by 1.3,
    inertias, springs and ratios by 2, 0.5 to 5 kHz, up to two samples of delay, with or without a filter."""
    rng = np.random.default_rng([seed, len(kind)])
    document = tomllib.loads(new_device("drawn", kind))
    mechanism = document["mechanism"]
    legs = mechanism.get("legs", [])
    for part in mechanism["links"] if not legs else [*mechanism["links"], *legs[0]["links"][:1]]:
        for key, most in (("length_m", 1.1), ("mass_kg", 1.3), ("inertia_kg_m2", 2.0)):
            if key in part:
                part[key] = _scaled(part[key], most ** rng.uniform(-1.0, 1.0))
    for drive in [*mechanism.get("drives", []), *(drive for leg in legs for drive in leg["drives"])]:
        for key, most in (
            ("motor_inertia_kg_m2", 2.0),
            ("transmission_ratio", 1.5),
            ("stiffness_Nm_per_rad", 2.0),
        ):
            if key in drive:
                drive[key] = _scaled(drive[key], most ** rng.uniform(-1.0, 1.0))
    T = float(2e-4 * 10.0 ** rng.uniform(0.0, 1.0))
    loop = {"sampling_period_s": T, "delay_samples": float(rng.choice([0.0, 0.4, 1.0, 1.7]))}
    if rng.random() < 0.5:
        cutoff = float(0.5 / T * 10.0 ** rng.uniform(-1.3, -0.3))
        loop["velocity"] = {
            "filter": {"type": "butterworth", "order": int(rng.integers(1, 3)), "cutoff_Hz": cutoff}
        }
    document["loop"] = loop
    mechanism["damping"] = {"mode_ratio": float(rng.choice([0.0, 0.02, 0.1, 0.5]))}
    return from_document(document)


def _scaled(value, factor):
    return (np.array(value) * factor).tolist()


@dataclass(frozen=True)
class Tried:
    """Walls of a table at random postures in its cells, along random directions.

    radius  (n,) largest over the hands; nan where a wall could not be judged together with others
    inside  how many positions the table holds
    """

    position: np.ndarray
    direction: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    radius: np.ndarray
    inside: int

    @property
    def unstable(self):
        """How many walls grow; at K = 0 a device that stands nowhere has a root at 1, so that 1e-9 is left to
        rounding."""
        return int((self.radius > 1.0 + 1e-9).sum())


def try_table(table, count, seed):
    """Try walls by eigenvalues: of rectangles, and of bands along a direction; a third at the ends of a range."""
    rng = np.random.default_rng(seed)
    grid, d = table.grid, table.grid.dimensions
    index = np.array([grid.index(int(cell)) for cell in rng.choice(np.flatnonzero(table.level), count)])
    share = rng.random((count, d))
    share = np.where(rng.random((count, d)) < 0.05, np.round(share), share)  # on the line between two cells
    places = grid.low + grid.step * (index + share)
    directions = rng.standard_normal((count, d))
    K, B, inside = np.empty(count), np.empty(count), np.zeros(count, dtype=bool)
    for n in range(count):
        code, box = table.at(places[n])
        inside[n] = code == 0
        low, high, K[n] = box.low, box.high, box.stiffness * rng.choice([1.0, rng.random(), rng.random()])
        if inside[n] and rng.random() < 0.5:  # by the other function, with any stiffness it has a range for
            cell = grid.cell_at(places[n])
            K[n] = float(table.top[cell].max()) * rng.random()
            code, low, high = table.damping_at(places[n], K[n], directions[n])
            if code != 0:
                K[n], low, high = 0.0, box.low, box.high
        B[n] = rng.choice([low, high, low + (high - low) * rng.random()])
    rows = np.flatnonzero(inside)
    radius = largest_radii(table, places[rows], directions[rows], K[rows], B[rows])
    return Tried(places[rows], directions[rows], K[rows], B[rows], radius, len(rows))


def largest_radii(table, places, directions, K, B):
    """Spectral radii (n,) of walls at positions and directions by the table's axes, the largest over its hands."""
    grid, radius = table.grid, np.zeros(len(places))
    for device in table.question.devices:
        point = device.at(
            grid.through + places @ grid.axes,
            directions @ grid.axes,
            assembly=table.question.assembly,
            model=table.question.model,
        )
        assert (point.status == OK).all(), "the table holds no posture that cannot be had"
        own = radii_at_points(point, K, B)
        for n in np.flatnonzero(np.isnan(own)):
            own[n] = point[int(n)].check(K[n], B[n]).spectral_radius
        radius = np.maximum(radius, own)
    return radius


@dataclass(frozen=True)
class Worst:
    """The worst wall of a search: spectral radius, cell, stiffness and damping, place in the cell, direction."""

    radius: float
    cell: int
    stiffness: float
    damping: float
    share: np.ndarray
    direction: np.ndarray


def search_table(table, seed, each=12, rounds=12):
    """The wall with the largest spectral radius that a search finds at the corners of the bands of all directions.

    It begins at random postures and directions of the corner's cell, and goes on beside the worst with ever
    smaller steps.
    """
    rng = np.random.default_rng(seed)
    grid, d = table.grid, table.grid.dimensions
    corners = [
        (cell, K, B)
        for cell in np.flatnonzero(table.level).tolist()
        for j in range(table.levels)
        if table.ranges[cell, 0, j, 0] <= table.ranges[cell, 0, j, 1]
        for K in (max(table.stiffness_of_level(cell, 0, j), 1e-3), table.stiffness_of_level(cell, 0, j + 1))
        for B in table.ranges[cell, 0, j].tolist()
    ]
    cells, K, B = (np.array(column) for column in zip(*corners, strict=True))
    low = grid.low + grid.step * np.array([grid.index(int(cell)) for cell in cells])
    share, way = rng.random((len(cells), d)), rng.standard_normal((len(cells), d))
    best = largest_radii(table, low + share * grid.step, way, K, B)
    for turn in range(rounds):
        size = 0.5 * 0.6**turn
        for _ in range(each):
            other = np.clip(share + size * rng.standard_normal(share.shape), 0.0, 1.0)
            turned = way / np.linalg.norm(way, axis=1, keepdims=True) + size * rng.standard_normal(way.shape)
            radius = largest_radii(table, low + other * grid.step, turned, K, B)
            better = radius > best
            share[better], way[better], best[better] = other[better], turned[better], radius[better]
    worst = int(best.argmax())
    return Worst(float(best[worst]), int(cells[worst]), K[worst], B[worst], share[worst], way[worst])
