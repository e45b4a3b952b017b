"""Missing inertia, estimated: what a chart is worth where masses are guessed from drawings.

No source gives masses of the first Haply pantograph, only lengths; its proximal links are printed, its distal ones
cut from acrylic. So they are taken for flat bars, as a CAD program would before anything is weighed: width w,
thickness t, density rho known in ranges. Of a uniform bar of length l

    m = rho w t l,        I = m (l^2 + w^2) / 12   about its middle.

Bearings and the handle are a point mass at the end point, motors are small ones without gears, and the drives are
rigid and without friction, so that a wall feels one mass m_felt. Then the largest stiffness of the sampled wall is
known,

    K_max = (12 - 8 sqrt 2) m_felt / T^2,

and is as uncertain as the mass: the spread below is the whole of it, for everything else in this chart is assumed,
stiffness of the drives and friction above all. Walls that every estimate can render are those of the robust chart.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import zwidth

SAMPLES = 200
RANGES = {  # least, most
    "proximal density": (900.0, 1250.0),  # kg/m^3, printed, partly filled
    "distal density": (1170.0, 1200.0),  # acrylic
    "width": (0.010, 0.020),  # m
    "thickness": (0.004, 0.008),  # m
    "end mass": (0.005, 0.030),  # kg, bearings and handle
    "rotor": (1e-6, 5e-6),  # kg m^2, at the proximal link
}

geometry = zwidth.load("haply-pantograph")


def estimated(guess: dict[str, float]) -> dict[str, Any]:
    """Settings of the device file: what it does not know, for one guess of sections, densities and the rest."""
    w, t = guess["width"], guess["thickness"]
    settings: dict[str, Any] = {}
    for link in geometry.document["mechanism"]["links"]:
        name, length = link["name"], link["length_m"]
        part = "proximal" if name.startswith("proximal") else "distal"
        bar = guess[f"{part} density"] * w * t * length
        end = guess["end mass"] if name == geometry.document["mechanism"]["handle"]["link"] else 0.0
        mass = bar + end
        center = (0.5 * bar + end) * length / mass
        moment = bar * (length**2 + w**2) / 12 + bar * (0.5 * length - center) ** 2 + end * (length - center) ** 2
        address = f"mechanism.links.{name}"
        settings |= {f"{address}.mass_kg": mass, f"{address}.center_of_mass_m": [center]}
        settings[f"{address}.inertia_kg_m2"] = moment
    for drive in geometry.document["mechanism"]["drives"]:
        settings[f"mechanism.drives.{drive['name']}.motor_inertia_kg_m2"] = guess["rotor"]
        settings[f"mechanism.drives.{drive['name']}.transmission_ratio"] = 1.0
    return settings


def point(guess: dict[str, float]) -> zwidth.OperatingPoint:
    """The device of one guess at its reference."""
    return geometry.with_(estimated(guess)).at()


middle = point({name: 0.5 * (low + high) for name, (low, high) in RANGES.items()})
_shares = np.random.default_rng(1).random((SAMPLES, len(RANGES)))
guesses = [
    {name: low + share * (high - low) for share, (name, (low, high)) in zip(row, RANGES.items(), strict=True)}
    for row in _shares
]
points = [point(guess) for guess in guesses]
masses = np.array([one.effective.rigid_mass for one in points])
stiffest = np.array([one.chart(decay=False).stiffness_max for one in points])
low, median, high = np.quantile(stiffest, [0.05, 0.5, 0.95])

# Which guess the spread comes from: its correlation with the result, squared.
explained = {
    name: float(np.corrcoef(_shares[:, column], stiffest)[0, 1] ** 2) for column, name in enumerate(RANGES)
}
promised = zwidth.robust_chart([points[i].loop for i in np.argsort(stiffest)[:20]])

print(f"middle of all ranges: {middle.effective.rigid_mass:.4f} kg felt, {middle.chart().stiffness_max:.0f} N/m")
print(f"of {SAMPLES} guesses: 5 % below {low:.0f}, half below {median:.0f}, 95 % below {high:.0f} N/m")
print(f"stable for all of them: up to {promised.stiffness_max:.0f} N/m")
print("explained by", ", ".join(f"{name} {share:.0%}" for name, share in explained.items()))


def figure():
    """How the estimates of the largest stiffness are spread, and the wall that all of them render."""
    from matplotlib import pyplot

    axes = pyplot.figure().add_subplot()
    axes.hist(1e-3 * stiffest, bins=20)
    axes.axvline(1e-3 * promised.stiffness_max, color="black")
    axes.set_xlabel("largest stiffness [kN/m]")
    axes.set_ylabel("estimates")
    return axes


if __name__ == "__main__":
    figure().figure.savefig("missing_inertia.png")
