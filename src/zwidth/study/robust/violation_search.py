"""The search of a family for members that find a wall of the robust edge unstable.

From members that bind at a wall a pattern search climbs to the largest spectral radius. Searches climb beside each
other, and the members that they can try next are built together.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from typing import Final, TypeAlias

import numpy as np

from zwidth.chart.robust.chart import RobustChart
from zwidth.chart.table_radii import spectral_radii
from zwidth.loop.loop import Loop
from zwidth.study.robust.family import Family, FamilyMember, build_together

Wall: TypeAlias = tuple[float, float]  # K [N/m], B [N s/m]

SEARCHED: Final = 12  # number of walls of the edge at which each round searches for a worse member
FIRST_STEP, LAST_STEP = 0.25, 1e-3  # step of the pattern search, in shares of the ranges
EXCEEDS: Final = 1e-7  # excess of the spectral radius over 1 that makes a member join


class MemberRadii:
    """Spectral radii of walls for members of a family, each computed once."""

    def __init__(self, family: Family) -> None:
        self.family = family
        self._radii: dict[tuple[FamilyMember, Wall], float] = {}
        self._loops: dict[FamilyMember, Loop | None] = {}

    def prepare(self, wanted: Sequence[tuple[FamilyMember, Wall]]) -> None:
        """Compute those of all members that can be built together; the rest waits until it is needed."""
        pairs = [pair for pair in dict.fromkeys(wanted) if pair not in self._radii]
        number = {member: n for n, member in enumerate(dict.fromkeys(member for member, _ in pairs))}
        member_of = np.array([number[member] for member, _ in pairs], dtype=np.int64)
        walls = np.array([wall for _, wall in pairs]).reshape(-1, 2)
        for built in build_together(self.family, list(number)):
            if built.table is None:
                continue
            row = np.full(len(number), -1)
            row[built.rows] = np.arange(len(built.rows))
            own = np.flatnonzero(row[member_of] >= 0)
            radii = spectral_radii(built.table, row[member_of[own]], *walls[own].T)
            self._radii.update(
                (pairs[n], float(radius)) for n, radius in zip(own, radii, strict=True) if np.isfinite(radius)
            )

    def radius(self, member: FamilyMember, wall: Wall) -> float:
        """Spectral radius of a wall for a member; -1 for one that cannot be built."""
        if (member, wall) not in self._radii:
            loop = self._loop(member)
            radius = -1.0 if loop is None else np.abs(np.linalg.eigvals(loop.transition_matrix(*wall))).max()
            self._radii[member, wall] = float(radius)
        return self._radii[member, wall]

    @property
    def met_unknown(self) -> bool:
        """Whether some of the members looked at cannot be built."""
        return any(loop is None for loop in self._loops.values())

    def _loop(self, member: FamilyMember) -> Loop | None:
        if member not in self._loops:
            try:
                self._loops[member] = self.family.loop(member)
            except (ValueError, np.linalg.LinAlgError):
                self._loops[member] = None
        return self._loops[member]


def violating_members(
    radii: MemberRadii, charted: Sequence[FamilyMember], chart: RobustChart
) -> list[FamilyMember]:
    """Members found by the search for which a wall of the edge is unstable, the largest spectral radius first.

    charted  the members of the chart, which are not looked for
    """
    free, found = radii.family.free, dict[FamilyMember, float]()
    starts = [(charted[start], wall) for wall, binding in _searched_walls(chart) for start in binding]
    for member, radius in _worst_members(radii, starts):
        if radius > 1.0 + EXCEEDS and member not in charted:
            rounded = radii.family.member(member.operator, np.round([member.shares[k] for k in free], 6))
            found[rounded] = max(radius, found.get(rounded, 0.0))
    return sorted(found, key=lambda member: -found[member])


def _searched_walls(chart: RobustChart) -> list[tuple[Wall, tuple[int, ...]]]:
    """Walls of the edge to search from, with the members that bind there: the stiffest, where the binding member
    changes, and the middles of the longest arcs."""
    walls: list[tuple[Wall, tuple[int, ...]]] = []
    if chart.members_at_stiffness_max:
        walls.append(((chart.stiffness_max, chart.damping_at_stiffness_max), chart.members_at_stiffness_max))
    arcs = chart.boundary
    for arc, following in zip(arcs, (*arcs[1:], *arcs[:1]), strict=True):
        if arc.member != following.member:
            corner = float(arc.stiffness[-1]), float(arc.damping[-1])
            walls.append((corner, (arc.member, following.member)))
    longest = sorted(arcs, key=lambda arc: -len(arc.stiffness))
    for share in (0.5, 0.25, 0.75):
        for arc in longest[:4]:
            k = int(share * (len(arc.stiffness) - 1))
            K, B = (float((x[k] + x[k + 1]) / 2.0) for x in (arc.stiffness, arc.damping))
            walls.append(((K, B), (arc.member,)))
    return walls[:SEARCHED]


def _worst_members(
    radii: MemberRadii, starts: Sequence[tuple[FamilyMember, Wall]]
) -> list[tuple[FamilyMember, float]]:
    """The member and the radius that each search comes to, from a member at a wall."""
    found: dict[int, tuple[FamilyMember, float]] = {}
    climbing = {n: _climb(radii, *start) for n, start in enumerate(starts)}
    while climbing:
        wanted: list[tuple[FamilyMember, Wall]] = []
        for n, search in list(climbing.items()):
            try:
                wanted += [(member, starts[n][1]) for member in next(search)]
            except StopIteration as end:
                found[n] = end.value
                del climbing[n]
        radii.prepare(wanted)
    return [found[n] for n in range(len(starts))]


def _climb(
    radii: MemberRadii, start: FamilyMember, wall: Wall
) -> Generator[list[FamilyMember], None, tuple[FamilyMember, float]]:
    """Pattern search from a member for the largest spectral radius at a wall: one range at a time, the step halved
    when no range gives a larger one.

    Yields   members, some of which are tried next
    Returns  the member found, and its radius
    """
    best, step, free = start, FIRST_STEP, radii.family.free
    yield [start, *_around(start, free, step)]
    radius = radii.radius(start, wall)
    while step >= LAST_STEP:
        gained = False
        for k in free:
            for sign in (-1.0, 1.0):
                neighbour = _neighbour(best, k, sign * step)
                new_radius = radii.radius(neighbour, wall) if neighbour != best else -1.0
                if new_radius > radius:
                    best, radius, gained = neighbour, new_radius, True
                    yield list(_around(best, free, step))
        if not gained:
            step *= 0.5
    return best, radius


def _around(member: FamilyMember, free: Sequence[int], step: float) -> Iterator[FamilyMember]:
    """The neighbours that a search tries if none of them is worse, at this step and all smaller ones."""
    while step >= LAST_STEP:
        for k in free:
            yield _neighbour(member, k, -step)
            yield _neighbour(member, k, step)
        step *= 0.5


def _neighbour(member: FamilyMember, k: int, step: float) -> FamilyMember:
    """The member with another share of range k, at most to the range's end."""
    share = min(max(member.shares[k] + step, 0.0), 1.0)
    return FamilyMember(member.operator, (*member.shares[:k], share, *member.shares[k + 1 :]))
