"""Whether a mechanism can be put together: loops that close, drives that move it, motions that carry mass.

Of `MechanismArrays`, which may be of many designs, the first is checked: its numbers are those at [0]. The m
unknowns are the joint coordinates in the order passive, driven, free.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.device.address import members
from zwidth.device.faults import KeyMessages, comma_list, plural
from zwidth.device.schema.mechanism import MechanismSection
from zwidth.model.continuation import assemble_batch
from zwidth.model.handle_position import NEARBY, constraints, joint_axes, joint_mass_matrix
from zwidth.model.mechanism import FIXED, POSE, PRISMATIC, Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays, pack
from zwidth.model.posture import OK, Posture, solve_posture

CLOSED: Final = 1e-9  # gap of a closed loop, relative to the mechanism's size
RANK_TOLERANCE: Final = 1e-7  # of singular values, relative to the largest
RESTARTS: Final = 30  # random postures tried before a loop is said not to close
INDEPENDENT: Final = 1e-6  # share of the largest motion, below which a joint follows from others
PARALLEL: Final = 1e-9  # sine of the angle below which two axes are parallel
MOVING: Final = 1e-6  # share of the largest part of a motion, below which a joint rests in it


def mechanism_faults(mechanism: Mechanism, section: MechanismSection, *, assembled: bool = False) -> KeyMessages:
    """Path and sentence of every way in which the numbers of a mechanism do not fit together.

    assembled  True: it is known to close and to move mass (`assembles`)
    """
    mech = pack(mechanism)
    yield from _single_moment_faults(mechanism, mech, section)
    if assembled:
        return
    angles, gaps = close_loops(mechanism, mech)
    loops = members(section, "loops")
    open_loops = [k for k, gap in enumerate(gaps) if gap > CLOSED * mech.size[0]]
    for k in open_loops:
        parts = "points stay" if loops[k].entry.closes == "point" else f"{loops[k].entry.closes}s stay"
        yield (
            ("mechanism", *loops[k].path),
            f"cannot close: its two {parts} at least {gaps[k]:.3g} m apart; check lengths, origins and axes",
        )
    if not open_loops:
        yield from _freedom_faults(mechanism, mech, angles)


def surplus_drives(mechanism: Mechanism) -> tuple[int, ...]:
    """The drives beyond the freedom that loops leave a mechanism: of its drives in their order, those whose joints
    the ones before them and the free joints determine. () where there are no loops, or they do not close."""
    mech = pack(mechanism)
    if not mech.a.size or mech.driven < 2:  # mech.a.size: number of loops
        return ()
    angles, gaps = close_loops(mechanism, mech)
    if gaps.max() > CLOSED * mech.size[0]:
        return ()
    _, _, motions = _where_least_free(mech, angles)
    if motions.shape[1] >= mech.driven + mech.free:
        return ()
    scaled = motions / mech.unit[0][:, None]
    # the last unknowns are those of the drives, then the free ones
    first_driven = mech.joint.size - mech.driven - mech.free
    # rows of the unknowns that can move independently: the free ones, then each drive that adds one
    kept = [first_driven + mech.driven + drive for drive in range(mech.free)]
    surplus = []
    for drive in range(mech.driven):
        # the row is independent of those kept where the least singular value is not 0 but for rounding
        singular_values = np.linalg.svd(scaled[[*kept, first_driven + drive]], compute_uv=False)
        if len(singular_values) > len(kept) and singular_values[-1] > INDEPENDENT * singular_values[0]:
            kept.append(first_driven + drive)
        else:
            surplus.append(drive)
    return tuple(surplus)


def _freedom_faults(mechanism: Mechanism, mech: MechanismArrays, angles: Floats) -> KeyMessages:
    """Path and sentence of drives that are missing or too many for the freedom, and of motions without mass.

    angles  (n,) joint coordinates at which the loops are closed
    """
    angles, loop_rows, motions = _where_least_free(mech, angles)
    unknowns, freedom, drives = mech.joint.size, motions.shape[1], mech.driven
    if not freedom:
        yield (
            ("mechanism", "loops"),
            f"leave the mechanism no freedom: they hold all of its {plural(unknowns, 'joint coordinate')}; check "
            "axes and points",
        )
        return
    if freedom != drives + mech.free:
        free_text = f", and {mech.free} declared free" if mech.free else ""
        still_moving = _links_that_still_move(mechanism, mech, loop_rows)
        advice = "give each of them one drive"
        if freedom > drives + mech.free and still_moving:
            advice += (
                ", or declare free what nobody drives: with the drives held, "
                f"{comma_list(still_moving, 6)} can still move"
            )
        yield (
            ("mechanism", "drives"),
            f"are {drives}{free_text}, but the mechanism has {plural(freedom, 'degree')} of freedom "
            f"({plural(unknowns, 'joint coordinate')} less {unknowns - freedom} held by loops); {advice}",
        )
        return
    M = motions.T @ joint_mass_matrix(mechanism, angles) @ motions
    if np.isnan(M).any():  # masses, rotors or ratios are not known
        return
    eigenvalues = np.linalg.eigvalsh(M)
    # positive definite in spite of rounding
    if not eigenvalues[0] > freedom * np.finfo(float).eps * eigenvalues[-1]:
        yield (
            ("mechanism", "links"),
            "have a motion that moves no mass: the mass matrix is not positive definite; "
            "give mass_kg or inertia_kg_m2 to the links that move in it",
        )


def _links_that_still_move(mechanism: Mechanism, mech: MechanismArrays, loop_rows: Floats) -> list[str]:
    """Names of the links that can move while drives and free joints rest.

    loop_rows  (m, r) derivative of the loops' r equations by each unknown
    """
    passive = mech.joint.size - mech.driven - mech.free
    motions = null_space(loop_rows[:passive].T)
    if not motions.size:
        return []
    largest_parts = np.abs(motions).max(axis=1)
    moving = [mech.joint[unknown] for unknown in np.flatnonzero(largest_parts > MOVING * largest_parts.max())]
    return list(dict.fromkeys(mechanism.links.names[joint].partition("/")[0] for joint in moving))


def _where_least_free(mech: MechanismArrays, angles: Floats) -> tuple[Floats, Floats, Floats]:
    """Find where the loops leave the mechanism the fewest motions: here or nearby. Where links happen to be in
    line they leave more than elsewhere.

    angles  (n,) joint coordinates at which the loops are closed
    Returns such coordinates (n,); the derivative (m, r) there of the loops' r equations by each unknown; and the
    motions (m, f) of the unknowns that the loops leave
    """
    places = closed_nearby(mech, angles)
    goal, equations = np.zeros(6 if mech.controls == POSE else 3), int(mech.first_row[-1])
    # the equations of the loops come first; the goal is in those of the handle behind them, which are left out.
    # The unknowns are scaled by their units
    loop_rows = [constraints(mech, 0, place, goal)[0][:, :equations] * mech.unit[0][:, None] for place in places]
    freedoms = [null_space(rows.T) for rows in loop_rows]
    best = min(range(len(loop_rows)), key=lambda i: freedoms[i].shape[1])
    return places[best], loop_rows[best], mech.unit[0][:, None] * freedoms[best]


def closed_nearby(mech: MechanismArrays, angles: Floats) -> list[Floats]:
    """Joint coordinates (n,) that close the loops, and two more closed ones a small step away from them."""
    random = np.random.default_rng(1)
    unit = np.where(mech.kind == PRISMATIC, mech.size[0], 1.0)
    starts = angles + unit * random.uniform(-NEARBY, NEARBY, (2, len(angles)))
    return [angles, *_closed_from(mech, starts)[0]]


def _single_moment_faults(mechanism: Mechanism, mech: MechanismArrays, section: MechanismSection) -> KeyMessages:
    """Path and sentence of each inertia given by one number, the moment about the link's own axis, of links that
    also turn about others."""
    links = mechanism.links
    index_of = {name: link for link, name in enumerate(links.names)}
    # (n, 3) in the base frame, with all joints at 0
    axis = joint_axes(mechanism, np.zeros(len(links.names)))
    reported = set()
    for member in members(section, "links"):
        given, link = member.entry, index_of[member.entry.name]
        if (
            given.inertia_kg_m2 is None
            or len(given.inertia_kg_m2) != 1
            or given.inertia_kg_m2[0][0] == 0
            or member.path in reported
        ):
            continue
        for carrier in _ancestors(mechanism, link):
            if (
                links.joint[carrier] not in (FIXED, PRISMATIC)
                and np.linalg.norm(np.cross(axis[carrier], axis[link])) > PARALLEL
            ):
                reported.add(member.path)
                # the link: its joint coordinates are name/1, name/2, ..., name
                turner = links.names[carrier].partition("/")[0]
                yield (
                    ("mechanism", *member.path, "inertia_kg_m2"),
                    f"is one number, the moment about the link's axis, but '{turner}' turns the link "
                    "about another; give three moments [Ixx, Iyy, Izz] or a 3 x 3 matrix",
                )
                break


def close_loops(mechanism: Mechanism, mech: MechanismArrays) -> tuple[Floats, Floats]:
    """Joint coordinates that close the loops as well as may be, (n,), and the gap left in each loop, (k,) [m]:
    from the assemblies or, where none of them closes, from random starts."""
    n = len(mechanism.links.names)
    random = np.random.default_rng(0)
    # random starts: any angle, and slides by up to the size of the mechanism
    scale = np.where(mech.kind == PRISMATIC, mech.size[0] / np.pi, np.where(mech.kind == FIXED, 0.0, 1.0))
    starts = np.array(list(mechanism.assemblies.values()))
    for batch in (starts, scale * random.uniform(-np.pi, np.pi, (RESTARTS, n))):
        angles, gaps = _closed_from(mech, batch)
        worst = gaps.max(axis=1, initial=0.0)
        closed = np.flatnonzero(worst <= CLOSED * mech.size[0])
        best = int(closed[0]) if len(closed) else int(np.argmin(worst))
        if len(closed):  # the first assembly that closes: a later one may be singular throughout
            break
    return angles[best], gaps[best]


def _closed_from(mech: MechanismArrays, starts: Floats) -> tuple[Floats, Floats]:
    """Joint coordinates (N, n) to which closing the loops leads from starts (N, n), and the gaps left (N, k)
    [m]."""
    angles = np.array(starts, order="C")
    gaps = np.zeros((len(angles), mech.a.size))
    # writes into `angles` and `gaps`
    assemble_batch(mech, np.zeros(len(angles), dtype=np.int64), angles, gaps)
    return angles, gaps


def _ancestors(mechanism: Mechanism, link: int) -> Iterator[int]:
    """Indices of a link and of those that carry it, down to the base, which is left out."""
    while link >= 0:
        yield link
        link = int(mechanism.links.parent[link])


def null_space(A: Floats) -> Floats:
    """Orthonormal basis (n, f) of the motions to which equations A (r, n) answer with 0."""
    if not A.size:
        return np.eye(A.shape[1])
    _, values, rows = np.linalg.svd(A)
    rank = int(np.sum(values > RANK_TOLERANCE * max(values[0], np.finfo(float).tiny)))
    return np.asarray(rows[rank:].T)


def assembles(mechanism: Mechanism, assembly: str | None) -> bool:
    """Whether there is a posture at the reference, with a mass for every motion.

    What holds is what `mechanism_faults` checks of any mechanism, in a tenth of its time. Where it
    does not hold nothing is said: the mechanism may still be put together with its handle elsewhere.
    """
    try:
        posture = solve_posture(mechanism, mechanism.reference_position, assembly)
    except ValueError:
        return False
    return bool(masses_moved(posture).all())


def masses_moved(posture: Posture) -> Flags:
    """Marks (...) of postures in which every motion has a mass. Those that are not OK, or whose masses are not
    known, are marked, too."""
    known = (posture.status == OK) & ~np.isnan(posture.mass_matrix).any(axis=(-2, -1))
    M = np.where(known[..., None, None], posture.mass_matrix, np.eye(posture.mass_matrix.shape[-1]))
    eigenvalues = np.linalg.eigvalsh(M)
    least = M.shape[-1] * np.finfo(float).eps * eigenvalues[..., -1]
    return np.asarray(eigenvalues[..., 0] > least)
