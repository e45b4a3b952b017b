"""`zwidth show`: the device at a posture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.cli.answer import answer_table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.output import DATA, json_value
from zwidth.show.units import NONE, amount, percent, speaking_of_moments, typed

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.measures.description import BeamDescription, Description
    from zwidth.model.mechanism import Mechanism

MODES_SHOWN: Final = 10
SMALLEST: Final = 1e-12
"""Joint coordinates below it are shown as 0 [rad], [m]."""


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
        "angular_jacobian",
        "mass_matrix",
        "manipulability",
        "dynamic_manipulability",
        "isotropy",
        "beams",
        "missing",
        "sources",
    )

    def compute(self, case: CommandLine) -> Description:
        return case.point.describe()

    def document(self, case: CommandLine, result: Description) -> dict[str, Any]:
        """Numbers of the device, those that its file leaves out, sources, and under load the equilibrium."""
        from zwidth.device.plausibility import unknown_numbers

        unknown = unknown_numbers(case.device.document)
        missing = [
            {"path": path, "needed_for": missing_group.needed_for}
            for missing_group in unknown
            for path in missing_group.paths
        ]
        numbers = result.document() | {"missing": missing, "sources": case.device.sources}
        if case.device.load is not None:
            numbers["equilibrium"] = case.point.equilibrium.document(case.point.drives.names)
        return numbers

    def table(self, case: CommandLine, result: Description, document: Mapping[str, Any]) -> dict[str, list[Any]]:
        from zwidth.measures.description import entries

        return entries(json_value(document))

    def pages(self, case: CommandLine, result: Description, document: Mapping[str, Any]) -> Iterator[Any]:
        """Masses and frequencies, the balance under load, the mechanism, missing numbers, and sources."""
        values = json_value(document)
        if result.effective is not None:
            yield two_columns(_felt_rows(values))
        if case.device.load is not None:
            from zwidth.show.load_text import balance_rows, drive_rows

            yield two_columns([*balance_rows(case.point), *drive_rows(case.point)])
        if case.device.mechanism is not None:
            with speaking_of_moments(False):  # the mechanism's own lengths are none of the rendered axis
                yield from _mechanism_pages(case.device.mechanism, result, values)
        yield from _missing_numbers_tables(case.device)
        if values["sources"]:
            yield answer_table(["numbers", "source"], list(values["sources"].items()))


def _mechanism_pages(mechanism: Mechanism, result: Description, values: Mapping[str, Any]) -> Iterator[Any]:
    """Tables of dexterity, of joints, and of links that bend.

    values  the document as JSON has it
    """
    unit, dynamic_unit = _dexterity_units(mechanism, result)
    dynamic = ("dynamic manipulability", amount(values["dynamic_manipulability"], dynamic_unit))
    yield two_columns(
        [
            ("manipulability", amount(values["manipulability"], unit)),
            *([dynamic] if result.effective is not None else []),
            ("isotropy (1 is best)", amount(values["isotropy"])),
        ]
    )
    yield _joint_table(mechanism, values["joints_rad"])
    if result.beams:
        yield _beam_table(result.beams)


def _beam_table(beams: Sequence[BeamDescription]) -> Any:
    """Table of the links that bend."""
    rows = []
    for beam in beams:
        how = beam.method.replace("-", " ") + (f", {beam.modes}" if beam.method != "lumped" else "")
        masses = amount(beam.mass, "kg"), amount(beam.carried_mass, "kg") if beam.carried_mass else NONE
        rows.append((beam.link, how, *masses, amount(beam.first_frequency, "Hz")))
    return answer_table(["beam", "modelled by", "mass", "carries", "first alone, clamped"], rows)


def _felt_rows(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Rows (label, value) on masses and stiffness felt along the direction, and on natural frequencies."""
    return [
        ("link side", amount(values["link_side_mass_kg"], "kg")),
        ("motor side", amount(values["motor_side_mass_kg"], "kg")),
        ("both, rigid", amount(values["rigid_mass_kg"], "kg")),
        ("stiffness between", amount(values["stiffness_N_per_m"], "N/m")),
        ("natural frequencies", ", ".join(_mode_texts(values))),
    ]


def _joint_table(mechanism: Mechanism, joints: Mapping[str, Any]) -> Any:
    """The joints' coordinates: angles, or each with its unit where joints slide. What is rounding of 0 is shown
    as 0."""
    from zwidth.model.mechanism import PRISMATIC

    units: dict[str, list[str]] = {}
    # a joint of several coordinates has a link for each: those before the last are named LINK/1, LINK/2
    for name, kind in zip(mechanism.links.names, mechanism.links.joint, strict=True):
        units.setdefault(name.partition("/")[0], []).append("m" if kind == PRISMATIC else "rad")
    slides = any("m" in of_joint for of_joint in units.values())
    rows = []
    for name, value in joints.items():
        numbers = [
            0.0 if abs(coordinate) < SMALLEST else coordinate
            for coordinate in (value if isinstance(value, list) else [value])
        ]
        shown = [
            amount(coordinate, unit) if slides else amount(coordinate)
            for coordinate, unit in zip(numbers, units[name], strict=True)
        ]
        rows.append((name, ", ".join(shown)))
    return answer_table(["joint", "coordinate" if slides else "angle [rad]"], rows)


def _missing_numbers_tables(device: Device) -> Iterator[Any]:
    """Table of the numbers that the file leaves out, and of the answers that need them; nothing if it has all."""
    from zwidth.device.plausibility import unknown_numbers

    unknown = unknown_numbers(device.document)
    if unknown:
        yield answer_table(
            ["missing", "of", ""], [(group.group, group.names, group.needed_for) for group in unknown]
        )


def _dexterity_units(mechanism: Mechanism, result: Description) -> tuple[str, str]:
    """Units of manipulability and of dynamic manipulability.

    They are products of as many singular values as there are directions to move in, or to turn about where the
    drives control the orientation alone.
    """
    import numpy as np

    from zwidth.measures.dexterity import ZERO_ROW
    from zwidth.model.mechanism import ORIENTATION

    turns = mechanism.controls == ORIENTATION
    jacobian = result.angular_jacobian if turns else result.jacobian
    assert jacobian is not None
    rows = np.max(np.abs(jacobian), axis=1)  # of a direction in which it cannot move: rounding
    directions = min(jacobian.shape[1], int(np.sum(rows > ZERO_ROW * np.max(rows))))
    power = {2: "²", 3: "³"}.get(directions, "")
    return ("", f"1/(kg m²){power}") if turns else (f"m{power}", f"1/(kg m){power}")


def _mode_texts(document: Mapping[str, Any]) -> Iterator[str]:
    """Each natural frequency with its damping; of many, as links that bend have, the highest of the rest alone."""
    frequencies = document["natural_frequencies_Hz"]
    ratios = document["damping_ratios"] or [None] * len(frequencies)
    # two more than MODES_SHOWN would be no longer than the line that replaces them
    unshown = frequencies[MODES_SHOWN:] if len(frequencies) > MODES_SHOWN + 2 else []
    for frequency, ratio in zip(frequencies[: len(frequencies) - len(unshown)], ratios, strict=False):
        if frequency is None:  # JSON has null for infinite and nan
            yield "unstable"
        else:
            yield amount(frequency, "Hz") + (f" ({typed(percent(ratio))})" if ratio is not None else "")
    if unshown:
        yield f"{len(unshown)} more up to {amount(unshown[-1], 'Hz')}"
