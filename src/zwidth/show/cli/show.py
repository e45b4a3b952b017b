"""`zwidth show`: the device at a posture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver, sheet, table
from zwidth.show.cli.computing import NoAnswer, computing
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Question, about_a_device, as_json, example, output_option
from zwidth.show.cli.place import heading
from zwidth.show.output import DATA, destination, plain, write_data
from zwidth.show.units import amount, percent, typed

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.model.effective import EffectiveParameters
    from zwidth.model.mechanism import Floats, Mechanism
    from zwidth.model.plant import Plant

KEYS: Final = (
    "link_side_mass_kg",
    "motor_side_mass_kg",
    "rigid_mass_kg",
    "stiffness_N_per_m",
    "natural_frequencies_Hz",
    "damping_ratios",
    "joints_rad",
    "jacobian",
    "mass_matrix",
    "manipulability",
    "dynamic_manipulability",
    "isotropy",
    "sources",
)


@click.command(
    short_help="Show masses, stiffness, frequencies and dexterity of DEVICE.",
    epilog=example("zwidth show my-device.toml", "zwidth show my-device.toml --at 0.1,0.2 --direction 1,0 --json"),
)
@about_a_device
@output_option("Write the numbers (.csv .json).")
@as_json
def show(question: Question, output: str | None, as_json: bool) -> int:
    """Show DEVICE at a posture: masses and stiffness felt along the direction, frequencies, dexterity."""
    path = None if output is None else destination(output, DATA)
    device = question.device()
    if device.response is not None:
        return without_model(question, device, dict.fromkeys(KEYS) | {"sources": device.sources}, as_json)
    try:
        with computing(question):
            point = question.point(device)
            _ = point.unheld_plant  # whether the model applies
    except NoAnswer as none:
        return deliver(Answer(question.facts(device) | dict.fromkeys(KEYS), reason=str(none)), as_json)
    document = question.facts(device) | _numbers(device, point)
    if path is not None:
        document["file"] = str(path)
        write_data(path, document, flat(document))
    return deliver(Answer(document, lambda: list(_pages(question, device, document))), as_json)


def flat(document: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Every single value of a document with its dotted key, in the columns `key` and `value`."""
    entries = list(_entries(plain(document), ""))
    return {"key": [key for key, _ in entries], "value": [value for _, value in entries]}


def _entries(value: Any, key: str) -> Iterator[tuple[str, Any]]:
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if inner is None:
        yield key, value
        return
    for step, part in inner:
        yield from _entries(part, f"{key}.{step}" if key else str(step))


def _numbers(device: Device, point: OperatingPoint) -> dict[str, Any]:
    """What --json shows beyond the facts; None where inapplicable."""
    from zwidth.model.modes import natural_frequencies

    plant = point.unheld_plant
    dexterity = {} if point.mechanism is None else _dexterity(point.mechanism, point)
    return (
        dict.fromkeys(KEYS)
        | _felt(point.effective)
        | {"natural_frequencies_Hz": natural_frequencies(plant), "damping_ratios": _damping_ratios(plant)}
        | dexterity
        | {"sources": device.sources}
    )


def _felt(felt: EffectiveParameters) -> dict[str, Any]:
    return {
        "link_side_mass_kg": felt.link_side_mass,
        "motor_side_mass_kg": felt.motor_side_mass,
        "rigid_mass_kg": felt.rigid_mass,
        "stiffness_N_per_m": felt.stiffness,
    }


def _dexterity(mechanism: Mechanism, point: OperatingPoint) -> dict[str, Any]:
    from zwidth.measures.dexterity import dynamic_manipulability, isotropy, manipulability

    assert point.posture is not None
    angles, J = point.posture.angles, point.jacobian
    return {
        "joints_rad": dict(zip(mechanism.links.names, angles.tolist(), strict=True)),
        "jacobian": J,
        "mass_matrix": point.mass_matrix,
        "manipulability": manipulability(J),
        "dynamic_manipulability": dynamic_manipulability(J, point.whole_mass_matrix),
        "isotropy": isotropy(J),
    }


def _damping_ratios(plant: Plant) -> list[float | None] | None:
    """Damping ratio a/w of each natural frequency, None for rigid ones; None where damping couples modes.

    Hysteresis L adds what it loses per cycle at that frequency: x^T L x / (2 w^2), half the loss factor.
    """
    import numpy as np

    from zwidth.model.modes import real_modes

    modes = real_modes(plant)
    if modes is None:
        return None
    L = np.zeros_like(plant.stiffness) if plant.hysteresis is None else plant.hysteresis
    loss = np.einsum("ij,ik,kj->j", modes.shapes, L, modes.shapes)
    each = zip(modes.decay.tolist(), loss.tolist(), modes.frequency_squared.tolist(), strict=True)
    return [a / squared**0.5 + lost / (2.0 * squared) if squared > 0.0 else None for a, lost, squared in each]


def _pages(question: Question, device: Device, document: Mapping[str, Any]) -> Iterator[Any]:
    found = plain(document)
    yield heading(question, device)
    yield sheet(
        [
            ("link side", amount(found["link_side_mass_kg"], "kg")),
            ("motor side", amount(found["motor_side_mass_kg"], "kg")),
            ("both, rigid", amount(found["rigid_mass_kg"], "kg")),
            ("stiffness between", amount(found["stiffness_N_per_m"], "N/m")),
            ("natural frequencies", ", ".join(_modes(found))),
        ]
    )
    if found["joints_rad"]:
        units = _dexterity_units(document["jacobian"])
        yield sheet(
            [
                ("manipulability", amount(found["manipulability"], units[0])),
                ("dynamic manipulability", amount(found["dynamic_manipulability"], units[1])),
                ("isotropy (1 is best)", amount(found["isotropy"])),
            ]
        )
        yield table(
            ["joint", "angle [rad]"], [(name, amount(angle)) for name, angle in found["joints_rad"].items()]
        )
    if found["sources"]:
        yield table(["numbers", "source"], list(found["sources"].items()))
    if "file" in found:
        yield f"written: {found['file']}"


def _dexterity_units(jacobian: Floats) -> tuple[str, str]:
    """Units of both manipulabilities, products of as many singular values as there are directions to move in.

    jacobian  (3, d)  [m/rad]
    """
    import numpy as np

    from zwidth.measures.dexterity import MOVES

    rows = np.max(np.abs(jacobian), axis=1)
    r = min(jacobian.shape[1], int(np.sum(rows > MOVES * np.max(rows))))
    power = {2: "²", 3: "³"}.get(r, "")
    return f"m{power}", f"1/(kg m){power}"


def _modes(found: Mapping[str, Any]) -> Iterator[str]:
    frequencies = found["natural_frequencies_Hz"]
    for frequency, ratio in zip(frequencies, found["damping_ratios"] or [None] * len(frequencies), strict=True):
        if frequency is None:
            yield "unstable"
        else:
            yield amount(frequency, "Hz") + (f" ({typed(percent(ratio))})" if ratio is not None else "")
