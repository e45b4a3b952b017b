"""`zwidth felt`: what the hand feels of a wall."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from zwidth.show.cli.answer import sheet
from zwidth.show.cli.command import Case, Command
from zwidth.show.cli.contact_options import wall_options
from zwidth.show.cli.errors import BadInput
from zwidth.show.units import amount, percent, typed

if TYPE_CHECKING:
    from zwidth.measures.felt_wall import FeltWall


class Felt(Command):
    """Find what the hand feels of a wall that DEVICE renders: the impedance at the handle, and at rest."""

    name = "felt"
    summary = "Find what the hand feels of a wall that DEVICE renders."
    examples = (
        "zwidth felt my-device.toml --stiffness 2000 --damping 5",
        "zwidth felt my-device.toml --stiffness 2000 --damping 5 --output felt.svg",
    )
    options = wall_options()
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv: the impedances, .json)."
    keys = (
        "static_stiffness_N_per_m",
        "free_motion_mass_kg",
        "stiffness_max_N_per_m",
        "static_stiffness_at_stiffness_max_N_per_m",
        "static_stiffness_limit_N_per_m",
        "frequency_Hz",
        "impedance_real_Ns_per_m",
        "impedance_imag_Ns_per_m",
        "commanded_real_Ns_per_m",
        "commanded_imag_Ns_per_m",
        "free_motion_real_Ns_per_m",
        "free_motion_imag_Ns_per_m",
    )

    def asked(self, case: Case) -> dict[str, Any]:
        return {"wall_stiffness_N_per_m": case["stiffness"], "wall_damping_Ns_per_m": case["damping"]}

    def compute(self, case: Case) -> FeltWall:
        from zwidth.measures.felt import HandleError

        try:
            return case.point.felt(case["stiffness"], case["damping"])
        except HandleError:
            model = f"model {case.question.model}: " if case.question.model else ""
            raise BadInput(
                f"{case.question.name}: {model}there is no handle at which a hand could feel the wall; give "
                "plant.handle, or use another model"
            ) from None

    def reason(self, case: Case, result: FeltWall) -> str | None:
        if result.reason is None or result.stiffness_max is None:
            return result.reason
        return f"{result.reason}; the stiffest stable wall has {amount(result.stiffness_max, 'N/m')}"

    def pages(self, case: Case, result: FeltWall, document: Mapping[str, Any]) -> Iterator[Any]:
        yield sheet(list(_rows(result)))

    def write(self, case: Case, result: FeltWall, document: dict[str, Any], reason: str | None) -> str | None:
        if reason is None:
            return super().write(case, result, document, reason)
        del document["file"]  # of a wall that is not stable nothing is written
        return reason


def _rows(found: FeltWall) -> Iterator[tuple[str, str]]:
    wall = f"{amount(found.wall_stiffness, 'N/m')}, {amount(found.wall_damping, 'Ns/m')}"
    yield "wall", f"{wall}: {found.verdict}"
    if found.static_stiffness is not None:
        stiffness = found.wall_stiffness
        share = f" ({typed(percent(found.static_stiffness / stiffness))} of it)" if stiffness else ""
        yield "felt at rest", amount(found.static_stiffness, "N/m") + share
    if found.free_motion_mass == found.free_motion_mass:
        yield "felt in free motion", amount(found.free_motion_mass, "kg")
    if found.stiffness_max is not None:
        hardest = amount(found.static_stiffness_at_stiffness_max, "N/m")
        yield "hardest felt contact", f"{hardest}, of a wall of {amount(found.stiffness_max, 'N/m')}"
    if found.static_stiffness_limit < float("inf"):
        yield "no wall is felt above", amount(found.static_stiffness_limit, "N/m")
