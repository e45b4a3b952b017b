"""`zwidth felt`: what the hand feels of a wall."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver, sheet
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.heading import heading
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Finite, Question, about_a_device, as_json, example, output_option
from zwidth.show.output import DATA, FIGURES, destination, replacing, write_data
from zwidth.show.units import amount, percent, typed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from zwidth.device.device import Device

    Complex = NDArray[np.complex128]

COUNT: Final = 400  # frequencies, from LOWEST of half the sampling frequency up to HIGHEST of it
LOWEST, HIGHEST = 1e-3, 0.999
CURVES: Final = ("impedance", "commanded", "free_motion")
KEYS: Final = (
    "static_stiffness_N_per_m",
    "free_motion_mass_kg",
    "stiffness_max_N_per_m",
    "static_stiffness_at_stiffness_max_N_per_m",
    "static_stiffness_limit_N_per_m",
    "frequency_Hz",
    *(f"{name}_{part}_Ns_per_m" for name in CURVES for part in ("real", "imag")),
)


@dataclass(frozen=True)
class Felt:
    """What was found of one wall; impedances (k,) at the frequencies, None where the wall is not stable."""

    stiffness: float
    damping: float
    verdict: str
    static: float
    mass: float
    stiffest: float | None
    static_at_stiffest: float | None
    limit: float
    frequency: NDArray[np.float64]
    impedance: Complex | None
    commanded: Complex
    free_motion: Complex


@click.command(
    short_help="Find what the hand feels of a wall that DEVICE renders.",
    epilog=example(
        "zwidth felt my-device.toml --stiffness 2000 --damping 5",
        "zwidth felt my-device.toml --stiffness 2000 --damping 5 --output felt.svg",
    ),
)
@about_a_device
@click.option("--stiffness", metavar="K", type=Finite(), required=True, help="Stiffness of the wall [N/m].")
@click.option("--damping", metavar="B", type=Finite(), required=True, help="Damping of the wall [Ns/m].")
@output_option("Write a figure (.png .svg .pdf) or the data (.csv: the impedances, .json).")
@as_json
def felt(question: Question, stiffness: float, damping: float, output: str | None, as_json: bool) -> int:
    """Find what the hand feels of a wall that DEVICE renders: the impedance at the handle, and at rest."""
    path = None if output is None else destination(output, FIGURES + DATA)
    device = question.device()
    wall = {"wall_stiffness_N_per_m": stiffness, "wall_damping_Ns_per_m": damping}
    if device.response is not None:
        return without_model(question, device, wall | dict.fromkeys(KEYS), as_json)
    facts = question.facts(device) | wall
    try:
        with computing(question):
            found = _computed(question, device, stiffness, damping)
    except NoAnswer as none:
        return deliver(Answer(facts | dict.fromkeys(KEYS), reason=str(none)), as_json)
    document = facts | numbers(found)
    reason = _reason(found)
    if path is not None and reason is None:
        document["file"] = str(path)
        _write(path, found, document)
    pages = list(_pages(question, device, found, document.get("file")))
    return deliver(Answer(document, lambda: pages, reason), as_json)


def _computed(question: Question, device: Device, K: float, B: float) -> Felt:
    import numpy as np

    from zwidth.chart.chart import largest_stiffness
    from zwidth.chart.verdict import judge
    from zwidth.measures import felt as measures

    point = question.point(device)  # with the operator, if there is one, the wall is stable or not
    plant = point.unheld_plant
    if plant.handle is None:
        where = f"model {question.model}: " if question.model else ""
        raise BadInput(
            f"{question.name}: {where}there is no handle at which a hand could feel the wall; give plant.handle, "
            "or use another model"
        )
    verdict = judge(point.loop, [K], [B]).names[0]
    peak = largest_stiffness(point.loop)
    loop = point.without_operator.loop
    frequency = np.geomspace(LOWEST, HIGHEST, COUNT) * 0.5 / loop.period
    return Felt(
        stiffness=K,
        damping=B,
        verdict=verdict,
        static=float(measures.static_stiffness(plant, K)),
        mass=measures.free_motion_mass(plant),
        stiffest=peak.stiffness if peak else None,
        static_at_stiffest=float(measures.static_stiffness(plant, peak.stiffness)) if peak else None,
        limit=measures.hardest_static_stiffness(plant),
        frequency=frequency,
        impedance=measures.felt_impedance(loop, K, B, frequency) if verdict == "stable" else None,
        commanded=measures.commanded_impedance(K, B, frequency),
        free_motion=measures.free_motion_impedance(plant, frequency),
    )


def _reason(found: Felt) -> str | None:
    """Why there is no answer; None where there is one."""
    if found.verdict == "stable":
        return None
    hint = ""
    if found.stiffest is not None:
        hint = f"; the stiffest stable wall has {amount(found.stiffest, 'N/m')}"
    return f"this wall is {found.verdict}, so that there is no steady motion to feel{hint}"


def numbers(found: Felt) -> dict[str, Any]:
    """What was found under the keys of --json; what is only felt of a stable wall is null for another."""
    stable = found.impedance is not None
    curves = {
        f"{name}_{part}_Ns_per_m": None if values is None else getattr(values, part)
        for name, values in zip(CURVES, (found.impedance, found.commanded, found.free_motion), strict=True)
        for part in ("real", "imag")
    }
    return {
        "verdict": found.verdict,
        "static_stiffness_N_per_m": found.static if stable else None,
        "free_motion_mass_kg": found.mass,
        "stiffness_max_N_per_m": found.stiffest,
        "static_stiffness_at_stiffness_max_N_per_m": found.static_at_stiffest,
        "static_stiffness_limit_N_per_m": found.limit,
        "frequency_Hz": found.frequency,
        **curves,
    }


def _pages(question: Question, device: Device, found: Felt, file: str | None) -> Iterator[Any]:
    yield heading(question, device)
    wall = f"{amount(found.stiffness, 'N/m')}, {amount(found.damping, 'Ns/m')}: {found.verdict}"
    rows = [("wall", wall)]
    if found.impedance is not None:
        share = f" ({typed(percent(found.static / found.stiffness))} of it)" if found.stiffness else ""
        rows.append(("felt at rest", amount(found.static, "N/m") + share))
    if found.mass == found.mass:
        rows.append(("felt in free motion", amount(found.mass, "kg")))
    if found.stiffest is not None:
        hardest = f"{amount(found.static_at_stiffest, 'N/m')}, of a wall of {amount(found.stiffest, 'N/m')}"
        rows.append(("hardest felt contact", hardest))
    if found.limit < float("inf"):
        rows.append(("no wall is felt above", amount(found.limit, "N/m")))
    yield sheet(rows)
    if file is not None:
        yield f"written: {file}"


def _write(path: Path, found: Felt, document: dict[str, Any]) -> None:
    if path.suffix.lower() in DATA:
        keys = ("frequency_Hz", *(key for key in document if key.endswith(("real_Ns_per_m", "imag_Ns_per_m"))))
        write_data(path, document, {key: document[key] for key in keys})
        return
    from zwidth.show.figures.felt import draw_impedance
    from zwidth.show.figures.style import figure, save

    assert found.impedance is not None
    drawing, ax = figure()
    draw_impedance(ax, found.frequency, found.impedance, found.commanded, found.free_motion)
    with replacing(path) as draft:
        save(drawing, draft)
