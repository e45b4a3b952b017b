"""Designs of a study that are built together at one operating point, and their loops."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zwidth.device.faults import DeviceError
from zwidth.loop.loop_table import LoopTable
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_loops import table_of_points
from zwidth.model.posture import OK, PostureError
from zwidth.study.designs.design_groups import DesignGroup, Rows


@dataclass(frozen=True)
class BuiltDesigns:
    """Designs of the same parts, built together.

    rows   (P,)  their numbers in the study
    point  (P,)  where they are
    """

    rows: Rows
    point: OperatingPoint

    @cached_property
    def table(self) -> LoopTable | None:
        """Their loops; one without sections, and all where this is None, are to be built alone."""
        return table_of_points(self.point)


def build_at_point(groups: Iterable[DesignGroup], point: OperatingPoint) -> Iterator[BuiltDesigns]:
    """The designs of each group at the operating point of a single device, as `Device.at_point` puts each of them.

    A design that is in none is to be built alone: it is not certain to be valid, it differs from no other of its
    group, its posture is out of reach, does not lie straight ahead or is given by joint angles, or the point has a
    response or several directions.
    """
    by_angles = isinstance(point.requested_position, Mapping)
    if by_angles or point.response is not None or point.direction_count > 1:
        return
    for group in groups:
        if not group.batch.differs:
            continue
        try:
            built, alone = group.batch.at_point(point)
        except (PostureError, DeviceError):
            continue  # each design alone says why
        kept = np.flatnonzero(group.valid & ~alone & (built.status == OK))
        if len(kept):
            yield BuiltDesigns(group.rows[kept], built[kept])
