"""What two keys must agree on: either-or, sizes, names that refer to names.

These checks read the plain document and skip every value that is itself faulty, so that they run
beside the checks of single keys and no fault hides another.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

from zwidth.device.address import exists, in_schema, is_number, row_count, table, tables
from zwidth.device.beam_plausibility import beam_faults
from zwidth.device.faults import KeyMessages, KeyPath, comma_list, plural, quote, suggestion
from zwidth.device.legs import spread_tables, written_path
from zwidth.device.loop_consistency import (
    electrical_faults,
    feedback_faults,
    load_faults,
    loop_faults,
    ratio_faults,
)
from zwidth.device.missing import partly_missing
from zwidth.device.nonlinear_consistency import nonlinear_faults
from zwidth.device.schema.device_file import flat_sources, keys

Check = Callable[[dict[str, Any]], KeyMessages]

HELD: Final = "held"  # the assembly of the arm's mechanism
ELASTIC: Final = ("grasp_stiffness_N_per_m", "grasp_damping_Ns_per_m")


def arm_faults(document: dict[str, Any], checks: tuple[Check, ...]) -> KeyMessages:
    """Path and sentence of every disagreement.

    checks  of a mechanism's table, which the arm's links are, too
    """
    if "arm" not in document:
        return
    arm = table(document, "arm")
    if "mechanism" not in document:
        yield ("arm",), "needs a [mechanism], whose handle it holds; give an [operator] instead"
    if "operator" in document:
        yield ("arm",), "stands beside [operator]; only one of them holds the handle: remove one"
    elastic = [key for key in ELASTIC if key in arm]
    if "grasp" in arm and elastic:
        yield ("arm", "grasp"), f"stands beside {' and '.join(elastic)}; only one way is allowed: remove one"
    if arm and "grasp" not in arm and ELASTIC[0] not in arm:
        yield ("arm",), 'does not say how it holds the handle; give grasp_stiffness_N_per_m, or grasp = "rigid"'
    for i, link in tables(arm, "links"):
        for key in ("mass_kg", "inertia_kg_m2"):
            if key not in link:
                yield ("arm", "links", i, key), "is missing; give it, 0 for a massless link"
        if "free" in link:
            yield ("arm", "links", i, "free"), "does not apply: all joints of an arm are free; remove it"
        if "beam" in link:
            yield ("arm", "links", i, "beam"), "does not apply: the links of an arm do not bend; remove it"
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
    for check in checks:
        for path, message in check(chain):
            yield _in_arm(path), message


def _in_arm(path: KeyPath) -> KeyPath:
    """A path of the mechanism that stands for the arm, in the arm."""
    if path[:3] == ("mechanism", "assemblies", HELD):
        return ("arm", "posture", *path[3:])
    if path[:2] == ("mechanism", "handle"):
        return ("arm", "hand", *path[2:])
    return ("arm", *path[1:])


KINDS: Final = ("mechanism", "plant", "response")
# Tables that only device files have, and keys that only studies have: they tell which of the two a file is.
DEVICE_KEYS: Final = frozenset({*KINDS, "loop"})
STUDY_KEYS: Final = frozenset({"measures", "axis", "tolerance"})
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


def inconsistencies(document: dict[str, Any], original: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement; `original` still has the sections not supported yet.

    Legs are checked as the copies that a mechanism has of them; a fault is reported where the leg is written.
    """
    spread, paths = spread_tables(table(document, "mechanism"))
    flat = {**document, "mechanism": spread} if spread else document
    for path, message in _inconsistencies(flat, original):
        yield written_path(path, paths), message
    yield from _sources(document)
    yield from _legs(table(document, "mechanism"))
    for path in partly_missing(table(document, "mechanism")):
        yield path, "is missing; give it here, or nowhere if it is not known"


def _inconsistencies(document: dict[str, Any], original: dict[str, Any]) -> KeyMessages:
    yield from _one_kind(original)
    yield from _plant(table(document, "plant"))
    yield from loop_faults(document)
    yield from feedback_faults(document)
    yield from nonlinear_faults(document)
    yield from _response(original)
    yield from electrical_faults(document)
    yield from operator_faults(document)
    yield from load_faults(document)
    yield from arm_faults(document, (_tree, _assemblies, _joint_keys))
    yield from _sampling(document)
    mechanism = table(document, "mechanism")
    if mechanism:
        yield from _tree(mechanism)
        if _joints(mechanism):
            yield from _references(mechanism)
            yield from ratio_faults(mechanism)
            yield from _assemblies(mechanism)
        yield from _joint_keys(mechanism)
        yield from beam_faults(mechanism)
        yield from _loop_keys(mechanism)
        yield from _place_of_handle(mechanism)
        yield from _workspace(mechanism)
        yield from _damping(mechanism)


def _one_kind(document: dict[str, Any]) -> KeyMessages:
    given = [f"[{kind}]" for kind in KINDS if kind in document]
    if not given:
        yield (), "has neither [mechanism] nor [plant] nor [response]; give one of them"
    elif len(given) > 1:
        yield (), f"has {' and '.join(given)}; only one of them is allowed: remove the other"


def _sampling(document: dict[str, Any]) -> KeyMessages:
    """Only a mechanism has answers without a computer."""
    loop = document.get("loop")
    misspelt = isinstance(loop, dict) and not set(loop) <= keys(("loop",))
    if isinstance(loop, dict) and "sampling_period_s" not in loop and "mechanism" not in document and not misspelt:
        yield ("loop", "sampling_period_s"), "is missing; give a number"
    if isinstance(loop, dict) and "delay_s" in loop and "sampling_period_s" not in loop:
        yield ("loop", "delay_s"), "needs sampling_period_s; give that, or delay_samples"


def _sources(document: dict[str, Any]) -> KeyMessages:
    sources = flat_sources(table(document, "sources"))
    for key in sources:
        if not exists(document, key) and not in_schema(key):
            yield ("sources", key), "names no key of this file; give a dotted path, with * for any step"


def _plant(plant: dict[str, Any]) -> KeyMessages:
    loss = plant.get("loss_factor")
    if is_number(loss) and loss > 0 and _springless(plant.get("stiffness_N_per_m")):
        yield (
            ("plant", "loss_factor"),
            "is a share of the stiffness, and there is none; give stiffness_N_per_m, or remove this",
        )
    size = row_count(plant.get("mass_kg"))
    if size is None:
        return
    for key in ("damping_Ns_per_m", "stiffness_N_per_m"):
        count = row_count(plant.get(key))
        if count is not None and count != size:
            yield ("plant", key), f"has {count} rows, but mass_kg has {size}; give a {size} x {size} matrix"
    for key in ("actuator", "sensor", "handle"):
        value = plant.get(key)
        length = 1 if is_number(value) else len(value) if isinstance(value, list) else None
        if length is not None and length != size:
            yield (
                ("plant", key),
                f"has {plural(length, 'number')}, but mass_kg has {plural(size, 'row')}; give {size}",
            )
        elif value is None and size > 1 and key != "handle":
            yield ("plant", key), f"is missing; with {size} coordinates give {size} numbers"


def _springless(stiffness: Any) -> bool:
    """Whether a stiffness is left out, or zero throughout."""
    if isinstance(stiffness, list):
        return all(map(_springless, stiffness))
    return stiffness is None or (is_number(stiffness) and stiffness == 0)


def operator_faults(document: dict[str, Any]) -> KeyMessages:
    """A handle to hold, one way of holding it, and a mass where the grasp is elastic."""
    operator, plant = table(document, "operator"), table(document, "plant")
    size = row_count(plant.get("mass_kg"))
    if "operator" in document and size is not None and size > 1 and "handle" not in plant:
        yield ("operator",), f"needs a handle; give plant.handle, {size} numbers, or leave the operator out"
    elastic = [key for key in ("grasp_stiffness_N_per_m", "grasp_damping_Ns_per_m") if key in operator]
    if "grasp" in operator and elastic:
        yield ("operator", "grasp"), f"stands beside {' and '.join(elastic)}; only one way is allowed: remove one"
    if operator and "grasp" not in operator and "grasp_stiffness_N_per_m" not in operator:
        yield (
            ("operator",),
            'does not say how the handle is held; give grasp_stiffness_N_per_m, or grasp = "rigid"',
        )
    mass = operator.get("arm_mass_kg")
    if elastic and "grasp" not in operator and is_number(mass) and mass == 0:
        yield (
            ("operator", "arm_mass_kg"),
            'must be greater than 0 behind an elastic grasp, got 0; give a mass, or grasp = "rigid"',
        )


def _response(document: dict[str, Any]) -> KeyMessages:
    """A measured response: one way of naming its files, and nothing beside it that it holds already."""
    if "response" not in document:
        return
    response, loop = table(document, "response"), table(document, "loop")
    if isinstance(document["response"], dict) and ("file" in response) == ("files" in response):
        fault = "names both file and files" if "file" in response else "names no file"
        yield ("response",), f"{fault}; give file for one measurement, or files for repetitions of it"
    if "actuator" in loop:
        yield ("loop", "actuator"), "is part of a measured [response] already; leave it out"
    period = loop.get("sampling_period_s")
    T = period if is_number(period) and 0 < period <= 1 else math.nan
    for key, unit in (("delay_samples", 1.0), ("delay_s", T)):
        delay = loop.get(key)
        if is_number(delay) and abs(delay / unit - round(delay / unit if delay / unit < 1e9 else 0)) > 1e-6:
            yield (
                ("loop", key),
                f"must be a whole number of samples with a [response], got {delay:.10g}: the response holds the "
                "device's own delay, and only what software adds stands here; leave it out",
            )


def _tree(mechanism: dict[str, Any]) -> KeyMessages:
    """Links: unique names, parents that exist, no link its own ancestor."""
    parents: dict[str, Any] = {}
    for index, link in tables(mechanism, "links"):
        name = link.get("name")
        if name == "base":
            yield (
                ("mechanism", "links", index, "name"),
                "is 'base', which stands for the ground; choose another",
            )
        elif isinstance(name, str):
            parents.setdefault(name, link.get("parent", "base"))
    for index, link in tables(mechanism, "links"):
        parent = link.get("parent")
        if isinstance(parent, str) and parent not in parents and parent != "base":
            yield (
                ("mechanism", "links", index, "parent"),
                f"'{parent}' is not a link; {suggestion(parent, {*parents, 'base'}, 'links')}",
            )
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
        yield from _twice(mechanism, group)


def _circle(name: Any, parents: dict[str, Any]) -> list[str]:
    """The links from this one back to itself, [] if it leads to the base."""
    if not isinstance(name, str):
        return []
    way, parent = [name], parents.get(name)
    while isinstance(parent, str) and parent in parents and parent not in way:
        way.append(parent)
        parent = parents[parent]
    return way if parent == name else []


def _twice(mechanism: dict[str, Any], group: str) -> KeyMessages:
    names_so_far: set[str] = set()
    for index, entry in tables(mechanism, group):
        name = entry.get("name")
        if isinstance(name, str) and name in names_so_far:
            yield ("mechanism", group, index, "name"), f"'{name}' is given twice; names must differ"
        elif isinstance(name, str):
            names_so_far.add(name)


def _references(mechanism: dict[str, Any]) -> KeyMessages:
    """Loops, handle and drives speak of links that exist; drives of revolute joints, one each."""
    links = _joints(mechanism)
    yield from _links_of_loops(mechanism, links)
    link = table(mechanism, "handle").get("link")
    if isinstance(link, str) and link not in links:
        yield (
            ("mechanism", "handle", "link"),
            f"'{link}' is not a link; {suggestion(link, links, 'links')}",
        )
    driven: set[str] = set()
    for index, drive in tables(mechanism, "drives"):
        joint, path = drive.get("joint"), ("mechanism", "drives", index, "joint")
        if not isinstance(joint, str):
            continue
        if joint not in links:
            yield path, f"'{joint}' is not a link; {suggestion(joint, links, 'links')}"
        elif links[joint] == "fixed":
            yield path, f"'{joint}' is fixed to its parent; a drive needs a revolute or prismatic joint"
        elif links[joint] in SEVERAL:
            yield (
                path,
                (
                    f"'{joint}' has a {links[joint]} joint; a drive needs a revolute or prismatic one: make it "
                    "of several, with links of no mass between them"
                ),
            )
        elif joint in driven:
            yield path, f"'{joint}' has a drive already; one joint takes one drive"
        driven.add(joint)
    yield from _couplings(mechanism, links, driven)


def _links_of_loops(mechanism: dict[str, Any], links: dict[str, Any]) -> KeyMessages:
    """Yield what is wrong with the links that loops join: names of none, and one link joined to itself.

    links  name -> joint of each link
    """
    for index, loop in tables(mechanism, "loops"):
        names = loop.get("links")
        names = names if isinstance(names, list) else []
        for place, name in enumerate(names):
            if isinstance(name, str) and name not in links and name != "base":
                yield (
                    ("mechanism", "loops", index, "links", place),
                    f"'{name}' is not a link; {suggestion(name, {*links, 'base'}, 'links')}",
                )
        if len(names) == 2 and names[0] == names[1]:
            yield (
                ("mechanism", "loops", index, "links"),
                f"joins '{names[0]}' to itself; name two different links",
            )


def _couplings(mechanism: dict[str, Any], links: dict[str, Any], driven: set[str]) -> KeyMessages:
    """Drives that turn with other joints, which are driven or free; motors on links that exist."""
    of_links = [link for _, link in tables(mechanism, "links") if link.get("free") is True]
    free = {name for link in of_links if isinstance(name := link.get("name"), str)}
    for index, drive in tables(mechanism, "drives"):
        if table(drive, "coupling") and not {"transmission_ratio", "ratio_table"} & drive.keys():
            yield ("mechanism", "drives", index, "transmission_ratio"), "is missing; coupling needs it"
        for name in table(drive, "coupling"):
            path: KeyPath = ("mechanism", "drives", index, "coupling", name)
            if name not in links:
                yield path, f"'{name}' is not a link; {suggestion(name, set(links), 'links')}"
            elif name == drive.get("joint"):
                yield path, "is the drive's own joint, whose ratio is transmission_ratio; remove it"
            elif name not in driven | free or links[name] in SEVERAL:
                yield path, f"'{name}' has no joint that is driven or free; a motor can turn with such joints only"
        link = drive.get("motor_link")
        if isinstance(link, str) and link not in links and link != "base":
            yield (
                ("mechanism", "drives", index, "motor_link"),
                f"'{link}' is not a link; {suggestion(link, {*links, 'base'}, 'links')}",
            )
        for key, other in (("motor_link", "motor_axis"), ("motor_axis", "motor_link")):
            if key in drive and other not in drive:
                yield ("mechanism", "drives", index, other), f"is missing; {key} needs it"


def _assemblies(mechanism: dict[str, Any]) -> KeyMessages:
    """Coordinates of the joints that have some, in the right table, as many as the joint has."""
    joints = _joints(mechanism)
    turning = {name: count for name, joint in joints.items() if (count := ANGLES.get(joint, 0))}
    sliding = {name: count for name, joint in joints.items() if (count := WAYS.get(joint, 0))}
    assemblies = table(mechanism, "assemblies")
    for name, assembly in assemblies.items():
        for key, counts, moves in (("joints_rad", turning, "turns"), ("joints_m", sliding, "slides")):
            given = assembly.get(key, {}) if isinstance(assembly, dict) else None
            if isinstance(given, dict):
                path = ("mechanism", "assemblies", name, key)
                yield from _coordinates(path, given, counts, moves)
                needed = {joint for joint in counts if joints[joint] not in ("spherical", "free")}
                for joint in sorted(needed - set(given)):
                    kind = (
                        "angle for every revolute joint"
                        if key == "joints_rad"
                        else "way for every prismatic joint"
                    )
                    yield (*path, joint), f"is missing; give an approximate {kind}"
    reference = table(mechanism, "reference")
    wanted, place = reference.get("assembly"), ("mechanism", "reference", "assembly")
    if isinstance(wanted, str) and assemblies and wanted not in assemblies:
        yield place, f"'{wanted}' is not an assembly; {suggestion(wanted, set(assemblies), 'assemblies')}"
    elif wanted is None and reference and len(assemblies) > 1:
        yield place, f"is missing; choose one of {comma_list(sorted(assemblies))}"


def _coordinates(path: KeyPath, given: dict[str, Any], counts: dict[str, int], moves: str) -> KeyMessages:
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


def _joint_keys(mechanism: dict[str, Any]) -> KeyMessages:
    """Keys of a link that only some joints have."""
    for index, link in tables(mechanism, "links"):
        joint = link.get("joint")
        if not isinstance(joint, str):
            continue
        for key, kinds in JOINT_KEYS.items():
            if key in link and joint not in kinds and link[key] is not False:
                yield (
                    ("mechanism", "links", index, key),
                    f"is of a {' or '.join(kinds)} joint, and this one is {joint}; remove it",
                )


def _loop_keys(mechanism: dict[str, Any]) -> KeyMessages:
    for index, loop in tables(mechanism, "loops"):
        for key, kind in (("axes", "axis"), ("orientation_rad", "frame")):
            if key in loop and loop.get("closes", "point") != kind:
                yield (
                    ("mechanism", "loops", index, key),
                    f'is used only with closes = "{kind}"; set that or remove this',
                )


def _place_of_handle(mechanism: dict[str, Any]) -> KeyMessages:
    """The reference gives what the drives control of the handle."""
    controls, reference = table(mechanism, "handle").get("controls", "position"), table(mechanism, "reference")
    path, given = ("mechanism", "reference"), isinstance(mechanism.get("reference"), dict)
    if given and "position_m" not in reference and controls != "orientation":
        yield (*path, "position_m"), "is missing; give the position of the handle"
    if "orientation_rad" in reference and controls == "position":
        yield (
            (*path, "orientation_rad"),
            "does not apply, as the drives control the handle's position alone; remove it, or say otherwise by "
            "mechanism.handle.controls",
        )
    if "position_m" in reference and controls == "orientation":
        yield (
            (*path, "position_m"),
            "does not apply, as the drives control the handle's orientation alone; remove it",
        )
    if given and "direction" not in reference and "axis" not in reference:
        yield (*path, "direction"), "is missing; give a rendered direction, or an axis for moments"
    screw = "direction" in reference and "axis" in reference
    if screw != ("characteristic_length_m" in reference):
        fault = (
            "is missing; direction and axis together need it" if screw else "is used only with direction and axis"
        )
        yield (*path, "characteristic_length_m"), fault


def _legs(mechanism: dict[str, Any]) -> KeyMessages:
    """Each leg says how many copies there are, one way."""
    for index, leg in tables(mechanism, "legs"):
        if ("angles_rad" in leg) == ("count" in leg):
            fault = "has angles_rad and count" if "count" in leg else "has neither angles_rad nor count"
            yield (
                ("mechanism", "legs", index),
                f"{fault}; give one of them: by what its copies are turned, or how many",
            )
    owners = [mechanism, *(leg for _, leg in tables(mechanism, "legs"))]
    if mechanism and mechanism.get("drives", []) == [] and not any(tables(owner, "drives") for owner in owners):
        yield ("mechanism", "drives"), "are missing; give one for each degree of freedom"


def _workspace(mechanism: dict[str, Any]) -> KeyMessages:
    position = table(mechanism, "reference").get("position_m")
    workspace = table(mechanism, "workspace")
    for axis, value in zip("xyz", position if isinstance(position, list) else [], strict=False):
        bounds = workspace.get(f"{axis}_m")
        if (
            isinstance(bounds, list)
            and len(bounds) == 2
            and all(map(is_number, [value, *bounds]))
            and bounds[0] < bounds[1]
            and not bounds[0] <= value <= bounds[1]
        ):
            yield (
                ("mechanism", "workspace", f"{axis}_m"),
                f"{quote(bounds)} leaves out the reference position, {axis} = {value:.10g}; widen it",
            )


def _damping(mechanism: dict[str, Any]) -> KeyMessages:
    damping, path = mechanism.get("damping"), ("mechanism", "damping")
    if isinstance(damping, dict):
        proportional = {"mass_coefficient_1_per_s", "stiffness_coefficient_s"} & damping.keys()
        ways = ["mode_ratio"] * ("mode_ratio" in damping)
        ways += [" and ".join(sorted(proportional))] * bool(proportional) + ["given"] * ("given" in damping)
        choice = "mode_ratio, or mass_coefficient_1_per_s and stiffness_coefficient_s, or given = true"
        if not ways:
            yield path, f"is empty; give {choice}"
        elif len(ways) > 1:
            yield path, f"has {', '.join(ways)}; exactly one way is allowed: {choice}"
    given = isinstance(damping, dict) and "given" in damping
    for index, drive in tables(mechanism, "drives"):
        if "damping_Nms_per_rad" in drive and not given:
            yield (
                ("mechanism", "drives", index, "damping_Nms_per_rad"),
                "is used only with mechanism.damping.given = true; set that or remove this",
            )
        stiffness, inertia = drive.get("stiffness_Nm_per_rad", math.inf), drive.get("motor_inertia_kg_m2")
        if is_number(inertia) and inertia == 0 and is_number(stiffness) and math.isfinite(stiffness):
            yield (
                ("mechanism", "drives", index, "motor_inertia_kg_m2"),
                "must be greater than 0 behind a flexible transmission, got 0; "
                "give the rotor's inertia, or leave stiffness_Nm_per_rad out",
            )


def _joints(mechanism: dict[str, Any]) -> dict[str, Any]:
    return {
        link["name"]: link["joint"] if isinstance(link.get("joint"), str) else None
        for _, link in tables(mechanism, "links")
        if isinstance(link.get("name"), str)
    }
