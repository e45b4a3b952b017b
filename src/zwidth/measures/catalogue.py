"""The catalogue of measures by name; the function of each is imported at its first use."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Final

from zwidth.measures.definition import Better, Measure
from zwidth.model.argument_checks import wrong_type

# Group of measures -> the file in which they stand, each as the function NAME_at of an operating point.
_FILES: Final = {
    "dexterity": "dexterity",
    "forces": "forces",
    "geometry": "geometry",
    "impedance": "impedance_range",
    "margins": "impedance_range",
    "closed_forms": "impedance_range",
    "load": "load_effect",
    "wall_decay": "vibration_decay",
    "wanted_wall": "deformation",
    "modes": "deformation",
    "felt": "handle_motion",
    "buzz": "buzz",
}
_OF_THE_MECHANISM: Final = ("dexterity", "forces", "geometry")  # groups whose measures need no loop
_OF_A_WALL: Final = (
    "wanted_wall",
    "wall_decay",
    "margins",
    "felt",
)  # groups whose measures are all about a wanted wall
_OF_DESIGNS: Final = (
    *_OF_THE_MECHANISM,
    "impedance",
    "wall_decay",
    "margins",
    "modes",
    "felt",
)  # groups that take designs at once


def _measure(
    group: str,
    name: str,
    title: str,
    unit: str,
    better: Better | None,
    source: str,
    *,
    each: bool = False,
    along: bool = True,
    wall: bool | None = None,
    linear: bool | None = None,
) -> Measure:
    """Measure of a group of the catalogue, computed by the function `NAME_at` of the group's file.

    name ... along  fields of `Measure`
    wall, linear    its `of_wall` and `linear`; None: as is usual in the group
    """
    linear = group not in _OF_THE_MECHANISM if linear is None else linear
    function = f"zwidth.measures.{_FILES[group]}:{name}_at"
    of_designs = group in _OF_DESIGNS and not each
    wall = group in _OF_A_WALL if wall is None else wall
    return Measure(
        name, title, unit, better, source, function, each, along, linear, of_wall=wall, of_designs=of_designs
    )


_YOSHIKAWA = "Yoshikawa 1985"
_MEASURES: Final = (
    # properties of the mechanism
    _measure(
        "dexterity",
        "manipulability",
        "Manipulability",
        "m^r/rad^r",
        "higher",
        f"{_YOSHIKAWA}; thesis eq. 5.1",
        along=False,
    ),
    _measure(
        "dexterity",
        "isotropy",
        "Condition number of the Jacobian",
        "",
        "lower",
        "Salisbury and Craig 1982; thesis eq. 5.2",
        along=False,
    ),
    _measure(
        "dexterity",
        "isotropy_frobenius",
        "Condition number of the Jacobian, Frobenius",
        "",
        "lower",
        "thesis eq. 5.2, Frobenius norm",
        along=False,
    ),
    _measure(
        "dexterity",
        "dynamic_manipulability",
        "Dynamic manipulability",
        "1/(kg m)^r",
        "higher",
        f"{_YOSHIKAWA}; thesis eq. 5.3",
        along=False,
    ),
    _measure(
        "dexterity",
        "dynamic_isotropy",
        "Condition number of the inertia matrix",
        "",
        "lower",
        "Ma and Angeles 1993; thesis 5.1",
        along=False,
    ),
    _measure(
        "dexterity",
        "handle_mass_isotropy",
        "Largest over smallest mass felt at the handle",
        "",
        "lower",
        "condition number of (J M^-1 J^T)^-1; Khatib 1987, thesis eq. 2.16",
        along=False,
    ),
    _measure("dexterity", "link_side_mass", "Link-side mass", "kg", None, "thesis eq. 2.28"),
    _measure("dexterity", "motor_side_mass", "Motor-side mass", "kg", None, "thesis eq. 2.28"),
    _measure(
        "dexterity", "rigid_mass", "Rigid mass of links and rotors", "kg", None, "Khatib 1987; thesis eq. 2.18"
    ),
    _measure("dexterity", "stiffness", "Structural stiffness", "N/m", "higher", "thesis eq. 2.34"),
    # room that it needs and leaves, and its first vibration
    _measure(
        "modes",
        "first_mode",
        "Frequency of the first flexible mode",
        "Hz",
        "higher",
        "least natural frequency above 0 of the plant without wall and hand",
    ),
    _measure(
        "geometry",
        "distance_to_singularity",
        "Reciprocal condition number of the homogeneous Jacobian",
        "",
        "higher",
        "Salisbury and Craig 1982; both kinds of singularity, Gosselin and Angeles 1990",
        along=False,
    ),
    _measure(
        "geometry",
        "joint_margin",
        "Distance of the joints from their limits, in half ranges",
        "",
        "higher",
        "1 in the middle of the range, 0 at a limit, inf without limits",
        along=False,
    ),
    _measure(
        "geometry",
        "link_clearance",
        "Clearance between links that share no joint",
        "m",
        "higher",
        "distance of rods with round ends, Ericson 2005 (known at second hand)",
        along=False,
        wall=True,
    ),
    _measure(
        "geometry",
        "reach",
        "Largest distance of a link from the middle of the base",
        "m",
        "lower",
        "of the ends of all links",
        along=False,
    ),
    _measure(
        "geometry",
        "reach_x",
        "Largest distance of a link from the middle of the base along x",
        "m",
        "lower",
        "of the ends of all links",
        along=False,
    ),
    _measure(
        "geometry",
        "reach_y",
        "Largest distance of a link from the middle of the base along y",
        "m",
        "lower",
        "of the ends of all links",
        along=False,
    ),
    _measure(
        "geometry",
        "reach_z",
        "Largest distance of a link from the middle of the base along z",
        "m",
        "lower",
        "of the ends of all links",
        along=False,
    ),
    # walls that it can render
    _measure(
        "impedance", "stiffness_max", "Largest virtual stiffness", "N/m", "higher", "exact, by D-decomposition"
    ),
    _measure(
        "impedance",
        "stiffness_max_decaying",
        "Largest virtual stiffness with a wanted decay",
        "N/m",
        "higher",
        "exact, by D-decomposition on the circle of the wanted spectral radius",
        wall=True,
    ),
    _measure(
        "margins",
        "stiffness_max_with_margins",
        "Largest virtual stiffness with margins",
        "N/m",
        "higher",
        "exact edges by D-decomposition, delays sampled, docs/measures.md",
    ),
    _measure(
        "impedance",
        "damping_max",
        "Largest virtual damping",
        "N s/m",
        "higher",
        "exact, by D-decomposition",
    ),
    _measure(
        "impedance",
        "stable_area",
        "Area of stable walls",
        "N^2 s/m^2",
        "higher",
        "exact, by D-decomposition",
    ),
    _measure(
        "impedance",
        "fastest_decay",
        "Smallest spectral radius of all walls",
        "",
        "lower",
        "exact, by D-decomposition",
    ),
    _measure(
        "closed_forms",
        "stiffness_max_closed_form",
        "Largest virtual stiffness, closed form of the undamped device",
        "N/m",
        "higher",
        "thesis eq. 5.4, 5.6, 5.7; structural damping left out",
    ),
    _measure(
        "closed_forms",
        "damping_max_closed_form",
        "Largest virtual damping, closed form of the undamped device",
        "N s/m",
        "higher",
        "thesis eq. 5.4, 5.6, 5.7; structural damping left out",
    ),
    _measure(
        "closed_forms",
        "stable_area_closed_form",
        "Area of stable walls, closed form of the undamped device",
        "N^2 s/m^2",
        "higher",
        "thesis eq. 5.5, 5.8; structural damping left out",
    ),
    # feel of a wanted wall
    _measure(
        "wanted_wall",
        "optimal_spectral_radius",
        "Optimal spectral radius",
        "",
        "lower",
        "thesis eq. 5.15; motor side on its spring, structural damping left out",
    ),
    _measure(
        "wanted_wall",
        "optimal_motor_side_mass",
        "Optimal motor-side mass",
        "kg",
        None,
        "thesis eq. 5.14; motor side on its spring, structural damping left out",
    ),
    _measure(
        "wall_decay",
        "spectral_radius",
        "Spectral radius at the wanted wall",
        "",
        "lower",
        "thesis eq. 2.40",
    ),
    _measure(
        "wall_decay",
        "decay_time",
        "Time in which vibration at the wanted wall decays to 1/e",
        "s",
        "lower",
        "T / -ln of the spectral radius",
    ),
    _measure(
        "wanted_wall",
        "structural_distortion",
        "Share of the motors' motion that deforms the structure",
        "",
        "lower",
        "structural deformation ratio, Moreyra and Hannaford 1998 (known at second hand)",
        each=True,
    ),
    _measure(
        "felt",
        "felt_stiffness",
        "Stiffness felt at the wanted wall",
        "N/m",
        "higher",
        "real part of force per displacement at the handle, docs/felt.md",
    ),
    _measure(
        "felt",
        "free_motion_force",
        "Force per velocity felt in free motion",
        "N s/m",
        "lower",
        "size of the impedance without a wall, docs/felt.md",
    ),
    _measure(
        "felt",
        "rate_hardness",
        "Rate-hardness: rate of the force on contact over the velocity",
        "N/m",
        "higher",
        "Lawrence, Pao and others 2000 (abstract read), steepest mean rate, docs/measures.md",
    ),
    _measure(
        "felt",
        "impedance_ratio",
        "Least ratio of the impedances of a wall and of free motion in a band",
        "",
        "higher",
        "dynamic range, Colgate and Brown 1994 (known from the abstract), by frequency",
    ),
    _measure(
        "buzz",
        "buzz",
        "Amplitude of a remaining vibration over the least that is felt",
        "",
        "lower",
        "limit cycles by harmonic balance; thresholds as in docs/measures.md (second-hand)",
        each=True,
        wall=True,
        linear=False,
    ),
    # what a load does
    _measure(
        "load",
        "load_change",
        "Change of the largest stiffness by the load, as a share",
        "",
        None,
        "exact, by D-decomposition with the load and without, docs/equilibrium.md",
        each=True,
    ),
    _measure(
        "load",
        "sideways_growth",
        "Growth rate of the fastest motion along the surface",
        "1/s",
        "lower",
        "roots of the sampled loop under load, docs/equilibrium.md",
        each=True,
    ),
    _measure(
        "load",
        "sideways_force",
        "Force of the hand across the direction that the posture needs",
        "N",
        "lower",
        "balance of thesis eq. 2.4, docs/equilibrium.md",
        each=True,
    ),
    # forces, accelerations and steps of its motors and encoders
    _measure("forces", "peak_force", "Peak force", "N", "higher", "J^T f within the drives' torque limits"),
    _measure(
        "forces",
        "continuous_force",
        "Continuous force",
        "N",
        "higher",
        "J^T f within the drives' continuous torques",
    ),
    _measure(
        "forces",
        "acceleration_max",
        "Largest acceleration",
        "m/s^2",
        "higher",
        "M J^+ u a within the drives' torque limits",
    ),
    _measure(
        "forces",
        "position_resolution",
        "Position resolution",
        "m",
        "lower",
        "sum of |u^T J_i| over the encoders' steps",
    ),
    _measure(
        "forces",
        "friction_force",
        "Dry friction felt along the direction",
        "N",
        "lower",
        "work of all drives' friction per metre",
    ),
    _measure(
        "forces",
        "motor_heat",
        "Heat of all windings while a force is held",
        "W",
        "lower",
        "sum of (torque/motor constant)^2",
        wall=True,
    ),
)

MEASURES: Final = {measure.name: measure for measure in _MEASURES}


def find_measure(name: str, user_measures: Mapping[str, Measure] | None = None) -> Measure:
    """The measure of a name, from the catalogue or a user's own; the name may end in its unit.

    user_measures  measures of a user's own, by name (`user_measures.load_measures`)
    Raises         ValueError  for an unknown name, with the nearest known one;  TypeError  for anything but a text

    >>> find_measure("stiffness_max").unit, find_measure("stiffness_max_N_per_m").name
    ('N/m', 'stiffness_max')
    """
    if not isinstance(name, str):
        raise wrong_type("name", "a measure's name", name)
    known = {**MEASURES, **(user_measures or {})}
    with_unit = {one.key: one for one in known.values()}
    if name in known or name in with_unit:
        return known.get(name) or with_unit[name]
    near = get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
    raise ValueError(f"no measure is named {name!r}; {hint}")
