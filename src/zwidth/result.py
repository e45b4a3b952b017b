"""`Result`: the methods of every result: a document, a table, a short repr and a figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

from zwidth import _verbs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from zwidth.loop.operating_point import OperatingPoint


class Result:
    """A result: numbers that can be read as a document, a table, a figure or in a notebook.

    `document()` holds every number under its key, the unit in the name, as `--json` prints it; `table()` holds
    columns of equal length, as a .csv file has them. `repr` is a few lines without arrays. The code that draws
    figures is imported only when `plot` is called or a notebook shows the result.

    operating_point  operating point of the result, which its figure states; None: a result without a device
    """

    operating_point: OperatingPoint | None = None

    def about(self, point: OperatingPoint) -> Self:
        """Remember the operating point that this result, just computed, is about; returns the result itself."""
        object.__setattr__(self, "operating_point", point)
        return self

    def document(self) -> dict[str, Any]:
        """Every number by its key."""
        raise NotImplementedError

    def table(self) -> Mapping[str, Any]:
        """Columns of equal length by their names."""
        raise NotImplementedError

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the result; returns the axes, in which more can be drawn.

        ax  axes to draw into; left out: those of a new figure of pyplot's, with a caption below that says which
            device it shows, where, and how it is sampled
        """
        return _verbs.plot(self, ax)

    def _repr_html_(self) -> str:
        """The result as notebooks show it, in HTML: its `repr` and its figure."""
        return _verbs.notebook(self)
