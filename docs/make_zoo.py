"""Write docs/zoo.md: every bundled device, what is known of it, and what it renders beside limits that people set.

`make docs` runs this. What a device renders is computed, and so is what its file lacks; typed in are only limits
and demonstrations that other people's programs contain, each with its place. Rounded so that machines agree.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import zwidth
from docs._markdown import table
from docs.make_examples import run
from zwidth.device import bundled_names
from zwidth.measures.dexterity import isotropy_at

HERE = Path(__file__).parent
PAGE = HERE / "zoo.md"
EXAMPLE = HERE.parent / "gallery" / "missing_inertia.py"

CHAI3D = "chai3d/chai3d, commit 7c76b1f2, src/devices"
SET_BY_HAND = {
    "novint-falcon": ("3000 N/m, 20 N s/m", "CDeltaDevices.cpp"),
    "novint-falcon-older": ("3000 N/m, 20 N s/m", "CDeltaDevices.cpp"),
    "phantom-premium-1.5": ("800 N/m, 5 N s/m (6DOF)", "CPhantomDevices.cpp"),
    "phantom-premium-1.5-cad": ("800 N/m, 5 N s/m (6DOF)", "CPhantomDevices.cpp"),
    "touch-omni": ("400 N/m, 4 N s/m; as Omni 700 N/m, 5 N s/m", "CPhantomDevices.cpp"),
    "woodenhaptics": ("1000 N/m, 8 N s/m", "haptikfabrikenapi.h"),
    "rice-haptic-paddle": ("5 N m/rad, 0.1 N m s/rad (demonstration)", "HapticPaddle, main.cpp"),
    "hapkit-course": ("500 N/m (demonstration)", "jvanhyn/Haptic-Interfaces"),
}
OTHERS = (  # Device, largest force [N], stiffness [N/m], damping [N s/m], radius of its workspace [m]
    ("delta.3", "20", "5000", "30", "0.15"),
    ("omega.3, omega.6, omega.7", "12", "5000", "30", "0.075"),
    ("sigma.7", "12", "4000", "30", "0.075"),
    ("lambda.7", "12", "8000", "30", "0.1125"),
    ("Falcon", "8", "3000", "20", "0.04"),
    ("Touch", "3.3", "400", "4", "0.075"),
    ("PHANToM Omni", "3.3", "700", "5", "0.10"),
    ("PHANToM Desktop", "7.9", "1000", "5", "0.10"),
    ("PHANToM Premium 1.5 6DOF", "8.5", "800", "5", "0.12"),
    ("PHANToM Premium 3.0 6DOF", "22", "1000", "5", "0.25"),
)

INTRODUCTION = """# Bundled devices

`zwidth devices` lists them, `zwidth show NAME` prints where each number comes from. Files hold only what a source
that could be read gives; the rest is left out, and said to be missing. A device with [geometry
only](device-files.md) answers kinematic questions, `zwidth map NAME --measure isotropy`, and refuses the others in
a sentence that names the keys it lacks; give them with `--set`, or in a copy of the file. `make docs` writes this
page from a run, and a test compares.

## What each is, and what it renders

Condition number, masses and walls are those at the file's reference; a mass is given for the direction in which
the handle feels lightest and for the one in which it feels heaviest, links and rotors together. Of a wrist they
are moments of inertia, and walls are in N m/rad.
"""

AFTER_TABLE = """*charts* under Data: masses, rotors, ratios and a sampling period are known, or said to be
placeholders; what is missing all the same, as friction, stands in the list below. Read the walls as upper bounds.
No source gives the stiffness of the cables of these devices, except for the five-bar: where the table says
*rigid*, drives are taken for rigid, and without friction, encoder steps or hand the largest stiffness of one mass
m sampled every T is (12 - 8 √2) m/T², {gram:.0f} N/m for each gram at 1 kHz. Limits set by hand are thirty and
more times lower, for they keep far from vibration with real cables, steps and filtered velocities; they are a
plausibility band and no measurement. `five-bar` shows what cables do: {soft:.1f} kN/m with them, {rigid:.0f} kN/m
if they were rigid.

Data sheets of manufacturers could not be read for these files: no apparent mass, back-drive friction or stiffness
of a sheet stands here.
"""

LIMITS = f"""## Limits that a library sets by hand

Of real devices, in {CHAI3D}: neither measured nor computed.
Touch and Omni are the same mechanism, with different numbers.
"""

CONTRADICTIONS = """## What sources disagree about

Each file says what it took. Where sources publish formulas beside numbers, only formulas that stand a check of
their own (a Jacobian against differences, energy against its derivative) judge the files in the tests.
"""
DISAGREEMENTS = (  # Device, what sources say, what its file has
    (
        "`phantom-premium-1.5`",
        "the moments of two lumped parts are 4.1 % and 3.4 % above what any body can have",
        "the same mass matrix in every posture, with moments shifted between parts that turn together about the "
        "vertical",
    ),
    (
        "`phantom-premium-1.5-cad`",
        "the mass matrix printed by its program turns three parts with wrong angular rates; rotor 1.08e-6 or "
        "1.03e-6 kg m²",
        "computed from the parts; the program's rotor",
    ),
    (
        "`openwrist`",
        "the mass matrix printed by its program has Ixx in the place of Izz, up to 20 % off; two sets of ratios, "
        "up to 6 % apart",
        "computed from the parts; the model's ratios",
    ),
    (
        "`novint-falcon`",
        "stored versions of its geometry differ in r, s, c",
        "both, `novint-falcon-older` with the other set",
    ),
    (
        "`novint-falcon`",
        "the Jacobian of its driver has sin² θ₂ for sin θ₂ sin θ₃",
        "that of Stamper's thesis judges",
    ),
    (
        "`stamper-delta`",
        "its table of positions was computed with 15.875 mm for the printed 15.9",
        "as printed: the table agrees to 0.1 mm",
    ),
    ("`haply-pantograph`", "its force map is 2 Jᵀ; the 2diy's is Jᵀ", "Jᵀ"),
    (
        "`touch-omni`",
        "upper arm 0.131 to 0.145 m; two identified mass matrices, both indefinite somewhere",
        "0.134 m; no inertia",
    ),
    (
        "`woodenhaptics`",
        "torque constant of the first motor 0.0259 or 0.321 N m/A; the sources' gravity compensation is not a "
        "derivative",
        "0.0259",
    ),
    ("`da-vinci-mtm`", "of nine identified tensors none is that of a body", "geometry, drives and limits"),
    (
        "`pantograph-mk2`",
        "the stored Jacobian differs from the derivative of the stored kinematics",
        "the derivative",
    ),
)


@dataclass(frozen=True)
class Row:
    """One device as the table has it."""

    name: str
    cells: list[str]


def rows() -> list[Row]:
    """Every bundled device, computed."""
    return [row(name) for name in bundled_names()]


def row(name: str) -> Row:
    device = zwidth.load(name)
    point = device.at()
    missing = device.missing
    by_hand, place = SET_BY_HAND.get(name, ("", ""))
    lacks = {"dynamics": "inertia", "sampling": "period"}
    known = "charts" if not missing else "lacks " + ", ".join(lacks[kind] for kind in missing)
    condition = "" if device.mechanism is None else f"{float(isotropy_at(point)):.3g}"
    felt, stiffness, wall = "", "", ""
    if not missing:
        felt = " to ".join(dict.fromkeys(f"{mass:.3g}" for mass in masses(point)))
        felt += " kg m²" if _turns(device) else " kg"
        between = float(point.effective.stiffness)
        stiffness = f"{between / 1e3:.3g} kN/m" if np.isfinite(between) else "rigid"
        largest = point.chart(decay=False).stiffness_max / 1e3
        wall = f"{largest:.3g} kN{' m/rad' if _turns(device) else '/m'}"
    return Row(name, [f"`{name}`", device.name, known, condition, felt, stiffness, wall, by_hand, place])


def masses(point: zwidth.OperatingPoint) -> list[float]:
    """Least and largest mass felt of links and rotors, over the directions in which the handle moves [kg, kg
    m^2]."""
    if point.mechanism is None or point.posture is None:
        return [float(point.effective.rigid_mass)]
    drives = point.mechanism.drives
    rotors = np.zeros(point.posture.mass_matrix.shape[0])
    rotors[: len(drives.joint)] = drives.motor_inertia * drives.transmission**2
    linear = point.posture.jacobian
    J = linear if np.any(np.abs(linear) > 1e-12) else point.posture.angular_jacobian
    inverse = J @ np.linalg.solve(point.posture.mass_matrix + np.diag(rotors), J.T)
    values = np.linalg.eigvalsh(inverse)
    moving = values[values > 1e-9 * values[-1]]
    return [float(1.0 / moving[-1]), float(1.0 / moving[0])]


def after_table() -> str:
    """How to read the table, with the five-bar's walls of flexible and of rigid drives."""
    device = zwidth.load("five-bar")
    soft, rigid = (device.at(model=model).chart(decay=False).stiffness_max / 1e3 for model in (None, "rigid"))
    return AFTER_TABLE.format(gram=(12.0 - 8.0 * 2.0**0.5) * 1e3, soft=soft, rigid=rigid)


def _turns(device: zwidth.Device) -> bool:
    return device.mechanism is not None and device.document["mechanism"]["handle"].get("controls") == "orientation"


def descriptions() -> str:
    """What each file says of itself, missing parts included."""
    said = [(zwidth.load(name).description, name) for name in bundled_names()]
    return "".join(
        f"- `{name}`: {text[0].lower() if text[1].islower() else text[0]}{text[1:]}.\n" for text, name in said
    )


def page() -> str:
    """The whole page."""
    header = ("Name", "Device", "Data", "Condition", "Mass felt", "Drives", "Largest wall", "Set by hand", "Where")
    example = run(EXAMPLE)
    estimate = (
        f"## Inertia that is missing, estimated\n\n[An example](../gallery/{EXAMPLE.name}) estimates the first "
        "Haply pantograph's masses from sections and\ndensities known in ranges, as drawings give them, and "
        f"says how uncertain the chart then is:\n\n```\n{example.printed}\n```\n\nMost of the spread is the mass "
        "at the end point, bearings and handle, which no drawing of links shows: weigh it first.\n"
    )
    return "\n".join(
        [
            INTRODUCTION,
            table(header, [one.cells for one in rows()]),
            after_table(),
            descriptions(),
            LIMITS,
            table(("Device", "Force [N]", "K [N/m]", "B [N s/m]", "Radius [m]"), [list(one) for one in OTHERS]),
            CONTRADICTIONS,
            table(("Device", "Contradiction", "Here"), [list(one) for one in DISAGREEMENTS]),
            estimate,
        ]
    )


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE.relative_to(HERE.parent))
