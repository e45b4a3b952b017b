"""`zwidth show`: the device at a posture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from zwidth.show.cli.answer import table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.output import DATA, json_value
from zwidth.show.units import amount, percent, typed

if TYPE_CHECKING:
    from zwidth.measures.description import Description
    from zwidth.model.mechanism import Floats


class ShowCommand(Command):
    """Show DEVICE at a posture: masses and stiffness felt along the direction, frequencies, dexterity."""

    name = "show"
    summary = "Show masses, stiffness, frequencies and dexterity of DEVICE."
    examples = ("zwidth show my-device.toml", "zwidth show my-device.toml --at 0.1,0.2 --direction 1,0 --json")
    outputs = DATA
    output_help = "Write the numbers (.csv .json)."
    keys = (
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

    def compute(self, case: CommandLine) -> Description:
        return case.point.describe()

    def document(self, case: CommandLine, result: Description) -> dict[str, Any]:
        return result.document() | {"sources": case.device.sources}

    def table(self, case: CommandLine, result: Description, document: Mapping[str, Any]) -> dict[str, list[Any]]:
        from zwidth.measures.description import entries

        return entries(json_value(document))

    def pages(self, case: CommandLine, result: Description, document: Mapping[str, Any]) -> Iterator[Any]:
        values = json_value(document)
        massless = case.point.missing.get("dynamics", ())
        if massless:
            more = f" and {len(massless) - 2} more" if len(massless) > 2 else ""
            yield f"  kinematics only: the file does not give {', '.join(massless[:2])}{more}\n"
        else:
            yield two_columns(_felt(values))
        if result.jacobian is not None:
            units = _dexterity_units(result.jacobian)
            dynamic = ("dynamic manipulability", amount(values["dynamic_manipulability"], units[1]))
            yield two_columns(
                [
                    ("manipulability", amount(values["manipulability"], units[0])),
                    *([] if massless else [dynamic]),
                    ("isotropy (1 is best)", amount(values["isotropy"])),
                ]
            )
            angles = [(name, _coordinates(value)) for name, value in values["joints_rad"].items()]
            yield table(["joint", "angle [rad]"], angles)
        if values["sources"]:
            yield table(["numbers", "source"], list(values["sources"].items()))


def _felt(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Masses and stiffness felt along the direction, and frequencies."""
    return [
        ("link side", amount(values["link_side_mass_kg"], "kg")),
        ("motor side", amount(values["motor_side_mass_kg"], "kg")),
        ("both, rigid", amount(values["rigid_mass_kg"], "kg")),
        ("stiffness between", amount(values["stiffness_N_per_m"], "N/m")),
        ("natural frequencies", ", ".join(_modes(values))),
    ]


def _coordinates(value: Any) -> str:
    """A joint's coordinate, or those of a joint with several."""
    return ", ".join(amount(one) for one in value) if isinstance(value, list) else amount(value)


def _dexterity_units(jacobian: Floats) -> tuple[str, str]:
    """Units of both manipulabilities, products of as many singular values as there are directions to move in.

    jacobian  (3, d)  [m/rad]
    """
    import numpy as np

    from zwidth.measures.dexterity import ZERO_ROW

    rows = np.max(np.abs(jacobian), axis=1)
    r = min(jacobian.shape[1], int(np.sum(rows > ZERO_ROW * np.max(rows))))
    power = {2: "²", 3: "³"}.get(r, "")
    return f"m{power}", f"1/(kg m){power}"


def _modes(document: Mapping[str, Any]) -> Iterator[str]:
    frequencies = document["natural_frequencies_Hz"]
    for frequency, ratio in zip(frequencies, document["damping_ratios"] or [None] * len(frequencies), strict=True):
        if frequency is None:
            yield "unstable"
        else:
            yield amount(frequency, "Hz") + (f" ({typed(percent(ratio))})" if ratio is not None else "")
