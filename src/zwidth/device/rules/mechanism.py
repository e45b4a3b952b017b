"""Rules of [mechanism]: names and trees of links, loops, drives, assemblies, the reference; ratio tables, beams,
damping; and of [arm], whose links are those of a mechanism, too."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any, Final

import numpy as np

from zwidth.device.address import is_number, table, tables
from zwidth.device.faults import KeyMessages, KeyPath, comma_list, plural, quote, suggestion
from zwidth.device.rules.plant import DRIVES, grasp_faults
from zwidth.device.rules.rule import Document, KeyRule, NumberRule, Rule, places, rule_faults

HELD: Final = "held"  # the assembly of the arm's mechanism
# Joints with several coordinates; how many angles and ways each joint has; the joints that have a key.
SEVERAL: Final = frozenset({"universal", "spherical", "free"})
ANGLES: Final = {"revolute": 1, "universal": 2, "spherical": 3, "free": 3}
WAYS: Final = {"prismatic": 1, "free": 3}
TURNING: Final = ("revolute", "universal", "spherical", "free")
MOVING: Final = ("revolute", "prismatic", "universal", "spherical", "free")
JOINT_KEYS: Final[dict[str, tuple[str, ...]]] = {
    "second_axis": ("universal",),
    "limits_rad": ("revolute",),
    "limits_m": ("prismatic",),
    "free": MOVING,
    **{f"joint_{key}": TURNING for key in ("stiffness_Nm_per_rad", "damping_Nms_per_rad", "coulomb_Nm")},
    **{f"joint_{key}": ("prismatic",) for key in ("stiffness_N_per_m", "damping_Ns_per_m", "coulomb_N")},
}
# Joint of a drive -> the key of the table's coordinates, the key of the link's limits, the unit.
OF_JOINT: Final = {"revolute": ("joint_rad", "limits_rad", "rad"), "prismatic": ("joint_m", "limits_m", "m")}
RATIO_KEYS: Final = {"joint_rad", "joint_m", "ratio"}
FULL_TURN: Final = 2.0 * math.pi * (1.0 + 1e-9)  # rad, to rounding
METHODS: Final = ("assumed-modes", "finite-elements", "lumped")
STIFFNESSES: Final = (
    "bending_stiffness_Nm2",
    "torsion_stiffness_Nm2",
    "axial_stiffness_N",
    "mass_per_length_kg_per_m",
    "torsional_inertia_per_length_kg_m",
)


def _tree_faults(document: Document) -> KeyMessages:
    """Path and sentence of links called base, whose names repeat, whose parents do not exist or that are their own
    ancestors, and of loops and drives whose names repeat."""
    mechanism = table(document, "mechanism")
    parents: dict[str, Any] = {}
    for index, link in tables(mechanism, "links"):
        name = link.get("name")
        if name == "base":
            yield ("mechanism", "links", index, "name"), "is 'base', which stands for the ground; choose another"
        elif isinstance(name, str):
            parents.setdefault(name, link.get("parent", "base"))
    for index, link in tables(mechanism, "links"):
        parent = link.get("parent")
        if isinstance(parent, str) and parent not in parents and parent != "base":
            yield ("mechanism", "links", index, "parent"), _no_link_sentence(parent, {*parents, "base"})
    reported: set[str] = set()
    for index, link in tables(mechanism, "links"):
        circle = _circle(link.get("name"), parents)
        if circle and not reported & set(circle):
            reported |= set(circle)
            yield (
                ("mechanism", "links", index, "parent"),
                f"goes round in a circle, {comma_list([*circle, circle[0]])}; one of them must start at 'base' "
                "(close loops by [[mechanism.loops]])",
            )
    for group in ("links", "loops", "drives"):
        yield from _repeated_names(mechanism, group)


def _circle(name: Any, parents: dict[str, Any]) -> list[str]:
    """The links from this one back to itself, [] if it leads to the base."""
    if not isinstance(name, str):
        return []
    way, parent = [name], parents.get(name)
    while isinstance(parent, str) and parent in parents and parent not in way:
        way.append(parent)
        parent = parents[parent]
    return way if parent == name else []


def _repeated_names(mechanism: dict[str, Any], group: str) -> KeyMessages:
    """Path and sentence of each name that a list of [mechanism], such as its links, gives a second time."""
    names_so_far: set[str] = set()
    for index, entry in tables(mechanism, group):
        name = entry.get("name")
        if isinstance(name, str) and name in names_so_far:
            yield ("mechanism", group, index, "name"), f"'{name}' is given twice; names must differ"
        elif isinstance(name, str):
            names_so_far.add(name)


def _no_link_sentence(name: str, links: Collection[str]) -> str:
    """The sentence for a name that is none of the links."""
    return f"'{name}' is not a link; {suggestion(name, links, 'links')}"


def _reference_faults(document: Document) -> KeyMessages:
    """Path and sentence of loops, handle or drives on links that do not exist, or whose joint they cannot have."""
    mechanism = table(document, "mechanism")
    joint_kinds = _joint_kinds(mechanism)
    yield from _loop_link_faults(mechanism, joint_kinds)
    link = table(mechanism, "handle").get("link")
    if isinstance(link, str) and link not in joint_kinds:
        yield ("mechanism", "handle", "link"), _no_link_sentence(link, joint_kinds)
    driven: set[str] = set()
    for index, drive in tables(mechanism, "drives"):
        joint, path = drive.get("joint"), ("mechanism", "drives", index, "joint")
        if not isinstance(joint, str):
            continue
        if joint not in joint_kinds:
            yield path, _no_link_sentence(joint, joint_kinds)
        elif joint_kinds[joint] == "fixed":
            yield path, f"'{joint}' is fixed to its parent; a drive needs a revolute or prismatic joint"
        elif joint_kinds[joint] in SEVERAL:
            yield (
                path,
                f"'{joint}' has a {joint_kinds[joint]} joint; a drive needs a revolute or prismatic one: make it "
                "of several, with links of no mass between them",
            )
        elif joint in driven:
            yield path, f"'{joint}' has a drive already; one joint takes one drive"
        driven.add(joint)
    yield from _coupling_faults(mechanism, joint_kinds, driven)


def _loop_link_faults(mechanism: dict[str, Any], links: dict[str, Any]) -> KeyMessages:
    """Yield what is wrong with the links that loops join: names of none, and one link joined to itself.

    links  name -> joint of each link
    """
    for index, loop in tables(mechanism, "loops"):
        names = loop.get("links")
        names = names if isinstance(names, list) else []
        for place, name in enumerate(names):
            if isinstance(name, str) and name not in links and name != "base":
                yield ("mechanism", "loops", index, "links", place), _no_link_sentence(name, {*links, "base"})
        if len(names) == 2 and names[0] == names[1]:
            yield ("mechanism", "loops", index, "links"), f"joins '{names[0]}' to itself; name two different links"


def _coupling_faults(mechanism: dict[str, Any], links: dict[str, Any], driven: set[str]) -> KeyMessages:
    """Path and sentence of couplings of drives to joints neither driven nor free or without a ratio, and motors on
    no link or without an axis.

    links   name -> joint of each link;   driven  names of the links whose joints have drives
    """
    of_links = [link for _, link in tables(mechanism, "links") if link.get("free") is True]
    free = {name for link in of_links if isinstance(name := link.get("name"), str)}
    for index, drive in tables(mechanism, "drives"):
        if table(drive, "coupling") and not {"transmission_ratio", "ratio_table"} & drive.keys():
            yield ("mechanism", "drives", index, "transmission_ratio"), "is missing; coupling needs it"
        for name in table(drive, "coupling"):
            path: KeyPath = ("mechanism", "drives", index, "coupling", name)
            if name not in links:
                yield path, _no_link_sentence(name, links)
            elif name == drive.get("joint"):
                yield path, "is the drive's own joint, whose ratio is transmission_ratio; remove it"
            elif name not in driven | free or links[name] in SEVERAL:
                yield path, f"'{name}' has no joint that is driven or free; a motor can turn with such joints only"
        link = drive.get("motor_link")
        if isinstance(link, str) and link not in links and link != "base":
            yield ("mechanism", "drives", index, "motor_link"), _no_link_sentence(link, {*links, "base"})
        for key, other in (("motor_link", "motor_axis"), ("motor_axis", "motor_link")):
            if key in drive and other not in drive:
                yield ("mechanism", "drives", index, other), f"is missing; {key} needs it"


def _ratio_tables(document: Document) -> KeyMessages:
    """Path and sentence of ratio tables beside a ratio or coupling, or unfit for the joint and its limits."""
    mechanism = table(document, "mechanism")
    links = {link["name"]: link for _, link in tables(mechanism, "links") if isinstance(link.get("name"), str)}
    for index, drive in tables(mechanism, "drives"):
        if "ratio_table" not in drive:
            continue
        place: KeyPath = ("mechanism", "drives", index, "ratio_table")
        if "transmission_ratio" in drive:
            yield place, "stands beside transmission_ratio; only one of the two is allowed: remove the other"
        if table(drive, "coupling"):
            yield (
                place,
                "cannot be had together with coupling: a motor that turns with several joints needs a constant "
                "ratio; give transmission_ratio, or remove coupling",
            )
        joint = drive.get("joint")
        link = links.get(joint) if isinstance(joint, str) else None
        if isinstance(drive["ratio_table"], dict) and link is not None and link.get("joint") in OF_JOINT:
            yield from _ratio_table_faults(place, drive["ratio_table"], link)


def _ratio_table_faults(place: KeyPath, given: dict[str, Any], link: dict[str, Any]) -> KeyMessages:
    """Path and sentence of one ratio table whose coordinates, ratios or range do not fit its drive's joint.

    place  path of the table;   given  the table;   link  table of the link whose joint is driven
    """
    joint = link["joint"]
    key, limits_key, unit = OF_JOINT[joint]  # no names in the sentences: the copies of a leg have the same fault
    for other, *_ in OF_JOINT.values():
        if other != key and other in given:
            yield (*place, other), f"is not for the joint of this drive, which is {joint}; give {key}"
            return
    if key not in given:
        if given.keys() <= RATIO_KEYS:  # or else one of them is misspelt
            yield (*place, key), "is missing; give the coordinates of the drive's joint at which the ratios are"
        return
    coordinates, ratios = given[key], given.get("ratio")
    if not isinstance(coordinates, list) or not isinstance(ratios, list):
        return
    if len(coordinates) != len(ratios):
        yield (
            (*place, "ratio"),
            f"has {plural(len(ratios), 'number')}, but {key} has {len(coordinates)}; give a ratio at each of them",
        )
    if len(coordinates) < 2 or not all(map(is_number, coordinates)):
        return
    low, high = coordinates[0], coordinates[-1]
    if unit == "rad" and high - low > FULL_TURN:
        yield (
            (*place, key),
            f"goes from {low:.10g} to {high:.10g} rad, more than a full turn; a turn more or less is the same "
            "posture: give one turn, 6.2831853 rad, or less",
        )
    limits = link.get(limits_key)
    if not (isinstance(limits, list) and len(limits) == 2 and all(map(is_number, limits)) and low < high):
        return
    if limits[0] < low or limits[1] > high:
        yield (
            (*place, key),
            f"goes from {low:.10g} to {high:.10g} {unit}, but {limits_key} of the joint are [{limits[0]:.10g}, "
            f"{limits[1]:.10g}]; extend the table over them, or narrow the limits",
        )


def _assemblies(document: Document) -> KeyMessages:
    """Path and sentence of assemblies that lack a joint's coordinates, give them to other joints, or another
    number of them; and of the reference's assembly, if it is none or must be chosen."""
    mechanism = table(document, "mechanism")
    joints = _joint_kinds(mechanism)
    turning = {name: count for name, joint in joints.items() if (count := ANGLES.get(joint, 0))}
    sliding = {name: count for name, joint in joints.items() if (count := WAYS.get(joint, 0))}
    assemblies = table(mechanism, "assemblies")
    for name, assembly in assemblies.items():
        # key of a table, coordinates of each joint in it, and two pieces of sentences
        for key, counts, moves, what in (
            ("joints_rad", turning, "turns", "angle for every revolute joint"),
            ("joints_m", sliding, "slides", "way for every prismatic joint"),
        ):
            given = assembly.get(key, {}) if isinstance(assembly, dict) else None
            if isinstance(given, dict):
                path = ("mechanism", "assemblies", name, key)
                yield from _coordinate_faults(path, given, counts, moves)
                # those begin at 0 where they are left out
                needed = {joint for joint in counts if joints[joint] not in ("spherical", "free")}
                for joint in sorted(needed - set(given)):
                    yield (*path, joint), f"is missing; give an approximate {what}"
    reference = table(mechanism, "reference")
    wanted, place = reference.get("assembly"), ("mechanism", "reference", "assembly")
    if isinstance(wanted, str) and assemblies and wanted not in assemblies:
        yield place, f"'{wanted}' is not an assembly; {suggestion(wanted, set(assemblies), 'assemblies')}"
    elif wanted is None and reference and len(assemblies) > 1:
        yield place, f"is missing; choose one of {comma_list(sorted(assemblies))}"


def _coordinate_faults(path: KeyPath, given: dict[str, Any], counts: dict[str, int], moves: str) -> KeyMessages:
    """Path and sentence of each joint in a table of coordinates that does not exist, or has another number of
    them.

    path    of the table;   given  the table
    counts  link name -> number of coordinates;   moves  how the table's joints move, for the sentence
    """
    for joint, value in given.items():
        if joint not in counts:
            yield (*path, joint), f"names no joint that {moves}; {suggestion(joint, set(counts), 'joints')}"
            continue
        length = len(value) if isinstance(value, list) else 1
        if length != counts[joint]:
            yield (
                (*path, joint),
                f"has {plural(length, 'number')}, but the joint has {counts[joint]}; give {counts[joint]}",
            )


def _joint_keys(document: Document) -> KeyMessages:
    """Path and sentence of each key of a link that its kind of joint does not read, unless it is false."""
    for index, link in tables(table(document, "mechanism"), "links"):
        joint = link.get("joint")
        if not isinstance(joint, str):
            continue
        for key, kinds in JOINT_KEYS.items():
            if key in link and joint not in kinds and link[key] is not False:
                yield (
                    ("mechanism", "links", index, key),
                    f"is of a {' or '.join(kinds)} joint, and this one is {joint}; remove it",
                )


def _beams(document: Document) -> KeyMessages:
    """Path and sentence of each disagreement of a link and its [beam]: length, joint, section, modes."""
    for path, link in places(document, "mechanism.links.*"):
        if isinstance(link.get("beam"), dict):
            yield from _beam_faults(path, link)


def _beam_faults(place: KeyPath, link: dict[str, Any]) -> KeyMessages:
    """Path and sentence of each disagreement of one link, at `place`, and its [beam]."""
    beam, at = table(link, "beam"), (*place, "beam")
    length = link.get("length_m", 0.0)
    if is_number(length) and not length > 0.0:
        yield (
            (*place, "length_m"),
            "is the length of the beam, and must be above 0; leave beam out of a rigid link",
        )
    if link.get("joint") in ("spherical", "universal", "free"):
        yield (
            at,
            f"does not go with a {link['joint']} joint at the link's base; use revolute, prismatic or fixed, or "
            "leave it out",
        )
    given = [key for key in STIFFNESSES if key in beam]
    if "section" in beam and given:
        yield (*at, given[0]), "stands beside section; give the section and its material, or all stiffnesses"
    elif not {"section", "material"} & beam.keys() and len(given) < len(STIFFNESSES):
        lacks = comma_list([key for key in STIFFNESSES if key not in given])
        yield at, f"lacks {lacks}; give all of them (large numbers for what hardly gives), or a section"
    for key, other in (("material", "section"), ("section", "material")):
        if other in beam and key not in beam:
            yield (*at, key), f"is missing; a {other} needs one"
    method = beam.get("method", "assumed-modes")
    for key, methods in (("elements", ("finite-elements",)), ("modes", ("finite-elements", "assumed-modes"))):
        if key in beam and method in METHODS and method not in methods:
            yield (*at, key), f"does not go with method = {method!r}; remove it"
    if "center_of_mass_m" in link and "mass_kg" not in link and "inertia_kg_m2" not in link:
        yield (
            (*place, "center_of_mass_m"),
            "stands without mass_kg and inertia_kg_m2; give those of the whole link too, or remove it for the "
            "beam's own",
        )
    if ("mass_kg" in link) != ("inertia_kg_m2" in link):
        lacking = "inertia_kg_m2" if "mass_kg" in link else "mass_kg"
        yield (
            (*place, lacking),
            "is missing; give mass and inertia of the whole link, or neither for the beam's own",
        )
    yield from _wall_fault((*at, "section"), table(beam, "section"))


def _wall_fault(place: KeyPath, section: dict[str, Any]) -> KeyMessages:
    """Path and sentence of a hollow section's wall that is thicker than half the section."""
    across = [section[key] for key in ("outer_diameter_m", "width_m", "height_m") if is_number(section.get(key))]
    wall = section.get("wall_m")
    if is_number(wall) and across and min(across) > 0.0 and wall > 0.5 * min(across) * (1.0 + 1e-12):
        solid = "rod" if "outer_diameter_m" in section else "rectangle"
        yield (
            (*place, "wall_m"),
            f"is {wall:g} m, more than half of {min(across):g} m, which leaves no section; write shape = "
            f"{solid!r} for a solid one",
        )


def _outside(position: Any, bounds: Any) -> Any:
    """Whether positions [m] are outside of bounds (..., 2) that rise."""
    low, high = bounds[..., 0], bounds[..., 1]
    return (low < high) & ~((low <= position) & (position <= high))


def _workspace_rule(index: int, axis: str) -> NumberRule:
    """The rule that the reference position lies within the workspace along an axis."""
    return NumberRule(
        "mechanism",
        f"workspace.{axis}_m",
        (f"reference.position_m.{index}", lambda mechanism: _two_bounds(mechanism.numbers(f"workspace.{axis}_m"))),
        _outside,
        lambda x, bounds: f"{quote(bounds)} leaves out the reference position, {axis} = {x:.10g}; widen it",
    )


def _two_bounds(bounds: Any) -> Any:
    """Lower and upper bounds (..., 2) as they are; None for what is no two numbers."""
    return bounds if bounds is not None and np.shape(bounds)[-1] == 2 else None


def _damping_ways(document: Document) -> KeyMessages:
    """Path and sentence of a [mechanism.damping] that gives no way of damping, or several."""
    damping, path = table(document, "mechanism").get("damping"), ("mechanism", "damping")
    if isinstance(damping, dict):
        proportional = {"mass_coefficient_1_per_s", "stiffness_coefficient_s"} & damping.keys()
        # the ways that the table gives, both numbers of proportional damping being one
        ways = ["mode_ratio"] * ("mode_ratio" in damping)
        ways += [" and ".join(sorted(proportional))] * bool(proportional) + ["given"] * ("given" in damping)
        choice = "mode_ratio, or mass_coefficient_1_per_s and stiffness_coefficient_s, or given = true"
        if not ways:
            yield path, f"is empty; give {choice}"
        elif len(ways) > 1:
            yield path, f"has {', '.join(ways)}; exactly one way is allowed: {choice}"


def _joint_kinds(mechanism: dict[str, Any]) -> dict[str, Any]:
    """Link name -> kind of its joint, such as "revolute"; None where the file gives no text for it."""
    return {
        link["name"]: link["joint"] if isinstance(link.get("joint"), str) else None
        for _, link in tables(mechanism, "links")
        if isinstance(link.get("name"), str)
    }


def _faults_of_named_links(document: Document) -> KeyMessages:
    """Faults of tables that name links: loops, handle, drives, ratio tables, assemblies; none without links."""
    if _joint_kinds(table(document, "mechanism")):
        yield from rule_faults((_reference_faults, _ratio_tables, _assemblies), document)


def _arm_faults(document: Document) -> KeyMessages:
    """Path and sentence of faults of [arm]: how its hand holds, and what of a chain of links a mechanism has,
    too."""
    arm = table(document, "arm")
    if "arm" not in document:
        return
    yield from grasp_faults("arm", arm, "how it holds the handle")
    names = {link["name"] for _, link in tables(arm, "links") if isinstance(link.get("name"), str)}
    hand = table(arm, "hand").get("link")
    if isinstance(hand, str) and names and hand not in names:
        yield ("arm", "hand", "link"), f"names no link of the arm; {suggestion(hand, names, 'links')}"
    posture = arm.get("posture", {})
    chain = {
        "links": arm.get("links", []),
        "handle": arm.get("hand", {}),
        "assemblies": {HELD: posture if isinstance(posture, dict) else {}},
    }
    for path, message in rule_faults((_tree_faults, _assemblies, _joint_keys), {"mechanism": chain}):
        yield _path_in_arm(path), message


def _path_in_arm(path: KeyPath) -> KeyPath:
    """Where the [arm] has what is at a path of the [mechanism] that stands for it."""
    if path[:3] == ("mechanism", "assemblies", HELD):
        return ("arm", "posture", *path[3:])
    if path[:2] == ("mechanism", "handle"):
        return ("arm", "hand", *path[2:])
    return ("arm", *path[1:])


def _no_drives(document: Document) -> KeyMessages:
    """Path and sentence of a mechanism of which neither it nor its legs have drives."""
    mechanism = table(document, "mechanism")
    owners = [mechanism, *(leg for _, leg in tables(mechanism, "legs"))]
    if mechanism and mechanism.get("drives", []) == [] and not any(tables(owner, "drives") for owner in owners):
        yield ("mechanism", "drives"), "are missing; give one for each degree of freedom"


LOOPS: Final = "mechanism.loops.*"
LEGS: Final = "mechanism.legs.*"
REFERENCE: Final = "mechanism.reference"
CONTROLS: Final = "/mechanism.handle.controls"
NO_ORIENTATION: Final = (
    "does not apply, as the drives control the handle's position alone; remove it, or say otherwise by "
    "mechanism.handle.controls"
)
NO_SCREW: Final = "is used only with direction and axis"
COPIES: Final = "give one of them: by what its copies are turned, or how many"
# fmt: off
ARM: Final[tuple[Rule, ...]] = (
    KeyRule("", "arm", "arm", "mechanism",
            "needs a [mechanism], whose handle it holds; give an [operator] instead"),
    KeyRule("", "arm", "arm operator", "",
            "stands beside [operator]; only one of them holds the handle: remove one"),
    *(KeyRule("arm.links.*", key, "", key, "is missing; give it, 0 for a massless link")
      for key in ("mass_kg", "inertia_kg_m2")),
    KeyRule("arm.links.*", "free", "free", "", "does not apply: all joints of an arm are free; remove it"),
    KeyRule("arm.links.*", "beam", "beam", "", "does not apply: the links of an arm do not bend; remove it"),
    _arm_faults,
)
MECHANISM: Final[tuple[Rule, ...]] = (
    _tree_faults,
    _faults_of_named_links,
    _joint_keys,
    _beams,
    KeyRule(LOOPS, "axes", "axes", "closes=axis", 'is used only with closes = "axis"; set that or remove this'),
    KeyRule(LOOPS, "orientation_rad", "orientation_rad", "closes=frame",
            'is used only with closes = "frame"; set that or remove this'),
    KeyRule(REFERENCE, "position_m", "", f"position_m {CONTROLS}=orientation",
            "is missing; give the position of the handle"),
    KeyRule(REFERENCE, "orientation_rad", f"orientation_rad {CONTROLS}=position", "", NO_ORIENTATION),
    KeyRule(REFERENCE, "orientation_rad", "orientation_rad", CONTROLS, NO_ORIENTATION),
    KeyRule(REFERENCE, "position_m", f"position_m {CONTROLS}=orientation", "",
            "does not apply, as the drives control the handle's orientation alone; remove it"),
    KeyRule(REFERENCE, "direction", "", "direction axis",
            "is missing; give a rendered direction, or an axis for moments"),
    KeyRule(REFERENCE, "characteristic_length_m", "direction axis", "characteristic_length_m",
            "is missing; direction and axis together need it"),
    *(KeyRule(REFERENCE, "characteristic_length_m", "characteristic_length_m", key, NO_SCREW)
      for key in ("direction", "axis")),
    *(_workspace_rule(index, axis) for index, axis in enumerate("xyz")),
    _damping_ways,
    KeyRule(DRIVES, "damping_Nms_per_rad", "damping_Nms_per_rad", "/mechanism.damping.given",
            "is used only with mechanism.damping.given = true; set that or remove this"),
    NumberRule(DRIVES, "motor_inertia_kg_m2", ("motor_inertia_kg_m2", "stiffness_Nm_per_rad"),
               lambda J, k: (J == 0.0) & np.isfinite(k),
               "must be greater than 0 behind a flexible transmission, got 0; give the rotor's inertia, or leave "
               "stiffness_Nm_per_rad out"),
)
LEGS_AS_WRITTEN: Final[tuple[Rule, ...]] = (
    KeyRule(LEGS, "", "angles_rad count", "", f"has angles_rad and count; {COPIES}"),
    KeyRule(LEGS, "", "", "angles_rad count", f"has neither angles_rad nor count; {COPIES}"),
    _no_drives,
)
# fmt: on
