"""What the keys of [arm] must agree on: names of links, angles of joints, masses, a way of holding."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

from zwidth.device.faults import KeyPath, suggestion
from zwidth.device.toml_access import table, tables

KeyMessages = Iterator[tuple[KeyPath, str]]
Check = Callable[[dict[str, Any]], KeyMessages]

HELD: Final = "held"  # the assembly of the arm's mechanism
ELASTIC: Final = ("grasp_stiffness_N_per_m", "grasp_damping_Ns_per_m")


def arm_inconsistencies(document: dict[str, Any], checks: tuple[Check, ...]) -> KeyMessages:
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
