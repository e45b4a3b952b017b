"""`zwidth export`: the safe walls over the workspace, for a haptic loop to clamp its gains by."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from zwidth.errors import NoAnswerError
from zwidth.questions import EXPORT
from zwidth.show.cli.answer import omissions, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput, as_option
from zwidth.show.cli.options import Callback as Callback
from zwidth.show.cli.options import Question, about_every_posture, options_of
from zwidth.show.cli.resumable import RESUME, WORKER_OPTIONS, check_workers, open_store, report_kept_work
from zwidth.show.output import DATA, FIGURES, printable, write_text
from zwidth.show.units import amount

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.study.wall_tables.safe_walls import SafeWallsJob
    from zwidth.study.wall_tables.table import SafeWalls

HEADER: Final = ".h"
ARRAY: Final = ".nc"


class ExportCommand(Command):
    """Write the safe walls of DEVICE over its workspace, for a haptic loop to clamp its gains by.

    A table of cells: in each the walls that are stable in every posture, every direction and with every hand; as
    a C header without dependencies (.h), or as data.
    """

    name = "export"
    summary = "Write safe gains over the workspace as a C header or a table."
    examples = (
        "zwidth export my-device.toml --margin 0.1",
        "zwidth export my-device.toml --hands none,thesis-arm --cells 20,10 --output safe_walls.h",
        "zwidth export my-device.toml --directions 4 --levels 8 --arduino my-wall --output safe.json",
    )
    options = (*options_of(EXPORT), RESUME, *WORKER_OPTIONS)
    outputs = (HEADER, *FIGURES, *DATA, ARRAY)
    output_help = (
        "Write a header (.h), a figure (.png .svg .pdf) or the data (.csv .json .nc). Default: safe_walls.h in "
        "this folder."
    )
    keys = (
        "file",
        "axes",
        "axis_vectors",
        "hands",
        "margin",
        "damping_span_Ns_per_m",
        "levels",
        "direction_parts",
        "table_bytes",
        "status",
        "stiffness_max_N_per_m",
        "damping_min_Ns_per_m",
        "damping_max_Ns_per_m",
        "outside",
        "notes",
    )
    no_response = (
        "a measured response has no masses and springs to follow through the workspace, and its chart has an "
        "uncertainty of its own; fit a [plant] with zwidth identify, or use zwidth chart"
    )

    def about(self, command: Callback) -> Callback:
        return about_every_posture(command)

    def default_output(self, question: Question) -> str:
        return "safe_walls.h"

    def check(self, case: CommandLine) -> None:
        """Refuse options of a run, or of hands, that do not go together, and a folder that cannot be written."""
        check_workers(case.options)
        if case["hands"] is not None and case.question.operator is not None:
            raise BadInput("--operator and --hands exclude each other; leave out --operator")
        if case["arduino"] is not None:
            _check_folder(Path(case["arduino"]))

    def parse(self, case: CommandLine) -> Mapping[str, Any]:
        """The names of --hands, each once. Raises BadInput for an empty one."""
        if case["hands"] is None:
            return {}
        names = tuple(dict.fromkeys(name.strip() for name in case["hands"].split(",")))
        if "" in names:
            raise BadInput(f"--hands: must be names with commas between them, got {case['hands']!r}")
        return {"hands": names}

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        """What every answer states, but for the posture, the direction and the operator."""
        # neither a single posture nor a direction; who holds the device is told by `hands`
        facts = super().circumstances(case)
        for key in ("position_m", "projected_m", "direction", "axis", "operator"):
            facts.pop(key, None)
        return facts

    def is_about_moments(self, case: CommandLine) -> bool:
        return False  # which `compute` refuses

    def compute(self, case: CommandLine) -> SafeWalls:
        """The table of safe walls, continued from its store where there is one. Raises NoAnswerError where no cell
        has a safe wall."""
        from zwidth.errors import TooLarge, WorkspaceError
        from zwidth.study.wall_tables.safe_walls import compute_table

        question, device = case.question, case.device
        if case["arduino"] is not None:
            _check_sketch(question.name, device)
        try:
            job = self._job(case)
            store = open_store(job, case.path, case["store"])
            with report_kept_work(store):
                table = compute_table(
                    device,
                    job,
                    case["span"],
                    store,
                    case.progress,
                    case["workers"],
                    cluster=case["cluster"],
                    time_limit=case["time_limit"],
                )
        except WorkspaceError as error:
            raise BadInput(f"{question.name}: {error.spelled(as_option)}") from None
        except TooLarge as error:
            raise BadInput(f"{question.name}: {error}") from None
        if not (table.level > 0).any():  # level 0: no safe wall
            if store is not None and case["store"] is None:
                store.remove()
            raise NoAnswerError(f"no cell has safe walls: {'; '.join(table.reasons)}")
        return table

    def _job(self, case: CommandLine) -> SafeWallsJob:
        """Return the job of the table that the command line asks for. Raises what `safe_walls_job` raises."""
        from zwidth.study.wall_tables.safe_walls import safe_walls_job

        return safe_walls_job(
            case.device,
            case["hands"],
            ranges=(case["x_range"], case["y_range"], case["z_range"]),
            cells=case["cells"],
            levels=case["levels"],
            directions=case["directions"],
            margin=case["margin"],
            size_limit=case["size_limit"],
            assembly=case.question.assembly,
            model=case.question.model,
            seed=case["seed"],
        )

    def table(self, case: CommandLine, result: SafeWalls, document: Mapping[str, Any]) -> dict[str, Any]:
        return result.table()

    def write(
        self, case: CommandLine, result: SafeWalls, document: dict[str, Any], reason: str | None
    ) -> str | None:
        """Write the header, the dataset, or what every command writes; then remove the finished work."""
        from zwidth.study.wall_tables.safe_walls import SafeWallsJob

        assert case.path is not None
        if case.writes([HEADER]):
            from zwidth.show.safe_walls_header import header_text

            write_text(case.path, header_text(result))
        elif case.writes([ARRAY]):
            from zwidth.show.dataset import write_dataset

            write_dataset(case.path, result.dataset())
        else:
            super().write(case, result, document, reason)
        if case["store"] is None:  # now that what it kept is written
            store = open_store(SafeWallsJob(result.question), case.path, None)
            if store is not None:
                store.remove()
        return reason

    def caption(self, case: CommandLine, document: Mapping[str, Any]) -> list[str]:
        """The lines below every command's figure, and one on what the walls hold for."""
        held = ", ".join("nobody" if hand == "none" else hand for hand in document["hands"])
        margin = f", gains off by {100.0 * document['margin']:.3g} %" if document["margin"] else ""
        return [*super().caption(case, document), f"stable in every direction, held by {held}{margin}"]

    def write_others(self, case: CommandLine, result: SafeWalls) -> dict[str, Path]:
        """Write the sketch for a board where --arduino names a folder."""
        if case["arduino"] is None:
            return {}
        from zwidth.show.safe_walls_header import write_sketch

        folder = Path(case["arduino"])
        write_sketch(folder, result)
        return {"arduino": folder}

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages say what cells hold for

    def pages(self, case: CommandLine, result: SafeWalls, document: Mapping[str, Any]) -> Iterator[Any]:
        """What the walls hold for, rows on the table, and why cells have no value."""
        yield f"{printable(result.device.name)}: walls that are stable {_scope_text(result)}"
        if document["left_out"]:
            yield from omissions(case.device, case.question.model)
        yield two_columns(list(_rows(result)))
        yield from (printable(reason) for reason in result.reasons)


def _check_folder(folder: Path) -> None:
    """Raise BadInput for a folder that cannot be made, or written into, before anything is computed."""
    where = folder if folder.exists() else folder.parent
    if not where.is_dir():
        raise BadInput(
            f"--arduino: {printable(str(folder))} is no folder and cannot be made one; name a new folder"
        )
    if not os.access(where, os.W_OK):
        raise BadInput(f"--arduino: {printable(str(where))} cannot be written into; name a folder elsewhere")


def _check_sketch(name: str, device: Device) -> None:
    """Raise BadInput for a device whose loop the sketch does not compute."""
    from zwidth.show.safe_walls_header import sketch_obstacle

    if obstacle := sketch_obstacle(device.controller):
        raise BadInput(f"--arduino: {printable(name)}: {obstacle}")


def _scope_text(table: SafeWalls) -> str:
    """What the walls of a table hold for, in words: postures, directions, and who holds the device."""
    where = "in every posture of a cell, " if table.grid.dimensions else ""
    along = "in every direction, " if table.grid.dimensions else ""
    held = ", ".join("nobody" if hand == "none" else printable(hand) for hand in table.hands)
    return f"{where}{along}held by {held}"


def _rows(table: SafeWalls) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on a table: cells, stiffness, walls safe in all cells, margin, directions, size."""
    grid, K = table.grid, table.rectangles[table.level > 0, 0]  # largest stiffness of each cell with safe walls
    if grid.dimensions:
        cells = " x ".join(map(str, grid.counts))
        yield "cells", f"{int((table.level > 0).sum())} of {cells} have safe walls"
    spread = (
        amount(float(K[0]), "N/m")
        if K.min() == K.max()
        else f"{amount(float(K.min()), 'N/m')} to " + amount(float(K.max()), "N/m")
    )
    yield "largest stiffness", spread
    safe_everywhere = table.outside
    if safe_everywhere.stiffness > 0.0:
        limits = f"{amount(safe_everywhere.low, 'N s/m')} to {amount(safe_everywhere.high, 'N s/m')}"
        yield (
            "safe in all of them",
            f"stiffness up to {amount(safe_everywhere.stiffness, 'N/m')} with damping of {limits}",
        )
    elif grid.dimensions:
        yield "safe in all of them", "no wall: outside the table there is no force"
    if table.question.margin:
        yield "margin", f"stiffness and damping may be off by {100.0 * table.question.margin:.3g} %"
    if table.question.slots > 1:
        yield "directions", f"{table.sectors.count} sectors, with a table each"
    yield "size", f"{table.size} bytes"
