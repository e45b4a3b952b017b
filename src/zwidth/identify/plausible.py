"""Whether a record's period and the mass that it tells are of the size that the device file gives."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Final

from zwidth.identify.identification import Check
from zwidth.identify.records.record import Record
from zwidth.identify.records.sampling import SAME_PERIOD, Sampling, unit_of_time

NEAR: Final = 2.0  # by which a ratio may differ from that of two units
UNLIKELY: Final = 20.0  # times the file's mass, either way, that is remarked

# Mass found, over that of the file -> what such a record holds: a mass is force over acceleration.
LINEAR_SLIPS: Final = {
    1e3: "the force in millinewtons",
    1e-3: "the position in millimetres, or the force in kilonewtons",
    1e-6: "the position in micrometres",
}
TURNING_SLIPS: Final = {
    1e3: "the torque in millinewton metres",
    1e-3: "the angle in milliradians",
    0.0174533: "the angle in degrees",
}


def check_periods(records: Sequence[Record], samplings: Sequence[Sampling], period: float) -> list[Check]:
    """Faults of records that another computer than the device's may have written; [] where all have its period.

    period  of the device's computer [s]
    """
    checks = list[Check]()
    for record, sampling in zip(records, samplings, strict=True):
        ratio = sampling.period / period
        if abs(ratio - 1.0) <= SAME_PERIOD:
            continue
        text = (
            f"the rows of {record.label} come every {sampling.period:.6g} s, the device's computer samples every "
            f"{period:.6g} s"
        )
        if unit := unit_of_time(ratio):
            checks.append(Check("sampling period", False, f"{text}: {unit}"))
            continue
        text += (
            "; right if another recorder wrote it. If not, all speeds and accelerations are wrong: correct "
            "time_s, or loop.sampling_period_s"
        )
        checks.append(Check("sampling period", False, text, warning=True))
    return checks


def check_mass_in_file(name: str, value: float, known: float, unit: str, *, turns: bool) -> list[Check]:
    """Whether the mass found is of the size that the file gives; [] where the file gives none.

    name, unit    of the mass, for messages
    value, known  found, and in the file [kg] or [kg m^2]
    turns         whether the motion is a turn, in radians
    """
    if not (isfinite(known) and known > 0.0 and value > 0.0):
        return []
    times = value / known
    text = f"{name} is about {value:.3g} {unit}, {times:.3g} times the {known:.4g} {unit} of the device file"
    for factor, slip in (TURNING_SLIPS if turns else LINEAR_SLIPS).items():
        if 1.0 / NEAR < times / factor < NEAR:
            text += f": is {slip}? Columns are in N, m, N m, rad. If the record is right, correct the file first"
            return [Check("mass in the file", False, text)]
    likely = 1.0 / UNLIKELY < times < UNLIKELY
    hint = "" if likely else ": check the units of the columns, and the mass in the file"
    return [Check("mass in the file", likely, text + hint, warning=not likely)]
