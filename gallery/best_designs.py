"""5.3 and 6.1: what an optimiser finds of the thesis's device, in place of its curves over one number at a time.

- "Achieving both dexterity and high stable virtual stiffness is in contrast" (5.3.1): over the lengths of both
  links, for a square of 6 cm that must be reached, the front of the least largest stiffness against the largest
  condition number. What is stiffer is less isotropic, all along it.
- The mass that (5.14) and (5.15) say decays fastest at a given wall is found again by search, from the
  eigenvalues' radius alone.

Run `python -m gallery.best_designs` to print both.
"""

from __future__ import annotations

import numpy as np

from gallery import optimal_mass
from zwidth.study import optimise, study_of


def like(link: str) -> list[object]:
    """The other side's link, and masses and inertias of both that go with the length."""
    other = link.replace("right", "left")
    return [
        f"links.{other}.length_m",
        *({"key": f"links.{one}.mass_kg", "power": 1} for one in (link, other)),
        *({"key": f"links.{one}.inertia_kg_m2", "power": 3} for one in (link, other)),
    ]


links = study_of(
    {
        "device": "five-bar",
        "axis": [
            {"key": "links.upper-right.length_m", "range": [0.10, 0.20], "tie": like("upper-right")},
            {"key": "links.distal-right.length_m", "range": [0.15, 0.25], "tie": like("distal-right")},
        ],
        "task": {"box_m": [[-0.03, 0.03], [0.21, 0.27]], "count": 3, "directions": 2},
        "optimise": {"objectives": {"stiffness_max": "max", "isotropy": "min"}, "budget": 300, "front": 8},
    },
    bounds=True,
)
front = optimise(links, workers=1)
stiffness, condition = front.values.T


def mass_by_search(wall: tuple[float, float]) -> tuple[float, float]:
    """Motor-side mass [kg] of least spectral radius at a wall K [N/m], B [N s/m], and that radius."""
    study = study_of(
        {
            "device": "published-two-mass",
            "model": "motor-mass",
            "set": ["plant.damping_Ns_per_m=unset"],
            "stiffness_N_per_m": wall[0],
            "damping_Ns_per_m": wall[1],
            "axis": [{"key": "plant.mass_kg.1.1", "range": [0.01, 0.5]}],
            "optimise": {"objectives": {"spectral_radius": "min"}, "budget": 400},
        },
        bounds=True,
    )
    found = optimise(study, workers=1)
    return float(found.design(0)["plant.mass_kg.1.1"]), float(found.values[0, 0])


found_masses = {name: mass_by_search(wall) for name, wall in optimal_mass.WALLS.items()}
mass_error = max(abs(found_masses[name][0] / optimal_mass.optimum[name][0] - 1.0) for name in found_masses)
radius_error = max(abs(found_masses[name][1] - optimal_mass.by_5_15[name]) for name in found_masses)
in_contrast = bool((np.diff(stiffness) < 0.0).all() and (np.diff(condition) < 0.0).all())

if __name__ == "__main__":
    for k, c in zip(stiffness, condition, strict=True):
        print(f"{k:.0f} N/m at least, condition number at most {c:.3f}")
    for name, (mass, radius) in found_masses.items():
        print(f"{name}: {mass:.7f} kg, spectral radius {radius:.6f}")
    print(f"off by {mass_error:.1e} in mass and {radius_error:.1e} in radius")
