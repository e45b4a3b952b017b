"""`zwidth felt`: what the hand feels of a wall."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from zwidth.questions import WALL
from zwidth.show.cli.answer import two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import options_of
from zwidth.show.units import amount, percent, typed

if TYPE_CHECKING:
    from zwidth.measures.felt import FeltWall


class FeltCommand(Command):
    """Find what the hand feels of a wall that DEVICE renders: the impedance at the handle, and at rest."""

    name = "felt"
    summary = "Find what the hand feels of a wall that DEVICE renders."
    examples = (
        "zwidth felt my-device.toml --stiffness 2000 --damping 5",
        "zwidth felt my-device.toml --stiffness 2000 --damping 5 --output felt.svg",
    )
    options = options_of(WALL)
    takes_responses = True
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv: the impedances, .json)."
    keys = (
        "static_stiffness_N_per_m",
        "free_motion_mass_kg",
        "stiffness_max_N_per_m",
        "static_stiffness_at_stiffness_max_N_per_m",
        "static_stiffness_limit_N_per_m",
        "static_stiffness_limit_kind",
        "frequency_Hz",
        "impedance_real_Ns_per_m",
        "impedance_imag_Ns_per_m",
        "commanded_real_Ns_per_m",
        "commanded_imag_Ns_per_m",
        "free_motion_real_Ns_per_m",
        "free_motion_imag_Ns_per_m",
    )

    def repeated_options(self, case: CommandLine) -> dict[str, Any]:
        return {"wall_stiffness_N_per_m": case["stiffness"], "wall_damping_Ns_per_m": case["damping"]}

    def compute(self, case: CommandLine) -> FeltWall:
        """The felt wall; a plant without a handle becomes BadInput."""
        from zwidth.errors import HandleError

        try:
            return case.point.felt(case["stiffness"], case["damping"])
        except HandleError:
            model = f"model {case.question.model}: " if case.question.model else ""
            raise BadInput(
                f"{case.question.name}: {model}there is no handle at which a hand could feel the wall; give "
                "plant.handle, or use another model"
            ) from None

    def reason(self, case: CommandLine, result: FeltWall) -> str | None:
        """Why the wall is not felt, with the stiffest stable one where that is known; None where it is."""
        if result.reason is None or result.stiffness_max is None:
            return result.reason
        return f"{result.reason}; the stiffest stable wall has {amount(result.stiffness_max, 'N/m')}"

    def pages(self, case: CommandLine, result: FeltWall, document: Mapping[str, Any]) -> Iterator[Any]:
        yield two_columns(list(_rows(result)))

    def write(
        self, case: CommandLine, result: FeltWall, document: dict[str, Any], reason: str | None
    ) -> str | None:
        """Write the file as every command does, but none where the wall is not stable."""
        if reason is None:
            return super().write(case, result, document, reason)
        del document["file"]  # of a wall that is not stable nothing is written
        return reason


def _rows(felt_wall: FeltWall) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on a wall: its verdict, what is felt at rest and in free motion, and at rest at most."""
    from zwidth.measures.felt import LIMIT_HEADINGS, LIMIT_WORDS

    wall = f"{amount(felt_wall.wall_stiffness, 'N/m')}, {amount(felt_wall.wall_damping, 'N s/m')}"
    yield "wall", f"{wall}: {felt_wall.verdict}"
    if felt_wall.static_stiffness is not None:
        stiffness = felt_wall.wall_stiffness
        share = f" ({typed(percent(felt_wall.static_stiffness / stiffness))} of it)" if stiffness else ""
        yield "felt at rest", amount(felt_wall.static_stiffness, "N/m") + share
    if felt_wall.free_motion_mass == felt_wall.free_motion_mass:  # not nan
        yield "felt in free motion", amount(felt_wall.free_motion_mass, "kg")
    if felt_wall.stiffness_max is not None:
        hardest = amount(felt_wall.static_stiffness_at_stiffness_max, "N/m")
        yield "hardest felt contact", f"{hardest}, of a wall of {amount(felt_wall.stiffness_max, 'N/m')}"
    kind = felt_wall.static_stiffness_limit_kind
    limit = LIMIT_WORDS.get(kind) or amount(felt_wall.static_stiffness_limit, "N/m")
    yield LIMIT_HEADINGS[kind], f"{limit}: nothing stiffer is felt" if kind == "bound" else limit
