"""Options of a wall along several directions at once: which directions, and how stiff and damped along each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.errors import BadInput, as_option
from zwidth.show.cli.options import ParamType
from zwidth.show.units import vector

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.loop.wall_matrices import WallMatrices
    from zwidth.show.cli.command import CommandLine


class MatrixType(ParamType):
    """Numbers along the directions, 1,0.2, or the rows of a matrix, 1,0.1;0.1,0.5."""

    name = "matrix"

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        return "R1,R2,...|ROW;ROW;..."

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """One row as a list of numbers, several as a list of such rows of one length; fails for all else."""
        if not isinstance(value, str):
            return value
        try:
            rows = [[float(entry) for entry in row.split(",")] for row in value.split(";")]
        except ValueError:
            rows = []
        rectangular = bool(rows) and len({len(row) for row in rows}) == 1
        if not rectangular or not all(math.isfinite(entry) for row in rows for entry in row):
            self.fail(f"must be numbers such as 1,0.2 or rows such as '1,0.1;0.1,0.5', got {value!r}", param, ctx)
        return rows if len(rows) > 1 else rows[0]


KINDS: Final = {name: MatrixType() for name in ("relative_stiffness", "relative_damping")}


def operating_point(case: CommandLine) -> OperatingPoint:
    """The operating point, with all directions of the wall. Raises BadInput, and what `Device.at` raises."""
    question, device = case.question, case.device
    if not case["directions"]:
        for name in ("relative_stiffness", "relative_damping"):
            if case[name] is not None:
                raise BadInput(
                    f"{as_option(name)} needs several directions; give more of them by --with-direction"
                )
        return case.point
    if device.mechanism is None:
        raise BadInput(
            f"{question.name}: has no [mechanism], and so one direction only; leave out --with-direction"
        )
    matrices = _matrices(case)
    question.refuse_unsupported(device)
    return device.at(
        question.at,
        directions=_directions(case),
        relative_stiffness=None if matrices is None else matrices.stiffness,
        relative_damping=None if matrices is None else matrices.damping,
        orientation=question.orientation,
        assembly=question.assembly,
        model=question.model,
    )


def circumstances(case: CommandLine) -> dict[str, Any]:
    """All directions of a wall and its matrices, as an answer states them; {} for one direction."""
    if not case["directions"]:
        return {}
    matrices = _matrices(case)
    law = (
        {}
        if matrices is None
        else {"relative_stiffness": matrices.stiffness, "relative_damping": matrices.damping}
    )
    return {"directions": _directions(case)} | law


def rows(stated: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on the directions of a wall, of what `circumstances` stated."""
    from zwidth.loop.wall_matrices import ratios_text

    together = " and ".join(map(vector, stated.get("directions", ())))
    if not together:
        return
    if "relative_stiffness" not in stated:
        yield "same wall along", together
        return
    yield "wall along", together
    yield "relative stiffness", ratios_text(stated["relative_stiffness"])
    yield "relative damping", ratios_text(stated["relative_damping"])


def _directions(case: CommandLine) -> list[Any]:
    """All directions rendered together, unit vectors: that of --direction, then those of --with-direction.

    Raises  BadInput  where --axis is given
    """
    question, device = case.question, case.device
    if question.axis is not None:
        raise BadInput(f"{question.name}: --axis and --with-direction do not go together; leave out one of them")
    return [device.direction(direction) for direction in (question.direction, *case["directions"])]


def _matrices(case: CommandLine) -> WallMatrices | None:
    """The matrices of the law; None where it is the same along each direction. Raises BadInput."""
    from zwidth.errors import ArgumentError
    from zwidth.loop.wall_matrices import WallMatrices

    stiffness, damping = case["relative_stiffness"], case["relative_damping"]
    if stiffness is None and damping is None:
        return None
    try:
        return WallMatrices.of(stiffness, damping, 1 + len(case["directions"]))
    except ArgumentError as error:
        raise BadInput(f"{as_option(error.argument)} {error.reasons[0]}") from None
