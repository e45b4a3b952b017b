"""From MJCF text or file to MuJoCo's compiled model: without meshes, with masses where the file gives none."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from zwidth.device.faults import Fault, fail
from zwidth.device.robot_files.robot import WARNING, Finding
from zwidth.errors import DeviceError

LEAST: Final = 1e-12  # of masses and moments that count as given, as in device files; MuJoCo allows 1e-15
MESH_KINDS: Final = ("mjGEOM_MESH", "mjGEOM_HFIELD", "mjGEOM_SDF")
ASSETS: Final = ("skins", "flexes", "meshes", "hfields", "materials", "textures")
ROUNDED: Final = 1e-9  # share of the largest moment, below which an excess is rounding


@dataclass
class Compiled:
    """A compiled model and what was changed to have it compiled.

    model     MjModel;  spec  MjSpec, with a name for every body and joint
    massless  names of bodies that have no mass of their own;  unknown  those of which the file says nothing
    """

    model: Any
    spec: Any
    massless: set[str] = field(default_factory=set)
    unknown: set[str] = field(default_factory=set)
    findings: list[Finding] = field(default_factory=list)


def mujoco_or_fail(label: str) -> Any:
    """The package mujoco. Raises DeviceError where it is not installed."""
    try:
        import mujoco
    except ImportError:
        raise fail(
            label, "", 'reading MJCF and URDF needs MuJoCo; install it with: pip install "zwidth[mjcf]"'
        ) from None
    return mujoco


@contextmanager
def warnings_of(mujoco: Any, into: list[Finding]) -> Iterator[None]:
    """Collect what MuJoCo warns of inside the block; it would print it, and write a file beside."""

    def keep(text: str) -> None:
        into.append(Finding("MuJoCo", " ".join(text.split()), WARNING))

    before = mujoco.get_mju_user_warning() if hasattr(mujoco, "get_mju_user_warning") else None
    if hasattr(mujoco, "set_mju_user_warning"):
        mujoco.set_mju_user_warning(keep)
    try:
        yield
    finally:
        if hasattr(mujoco, "set_mju_user_warning"):
            mujoco.set_mju_user_warning(before)


def compile_mjcf(label: str, parse: Callable[[Any], Any]) -> Compiled:
    """Compile a model description.

    label  what messages call the file
    parse  makes an MjSpec, given mujoco
    Raises DeviceError  with what MuJoCo refuses
    """
    mujoco = mujoco_or_fail(label)
    findings: list[Finding] = []
    with warnings_of(mujoco, findings):
        try:
            spec = parse(mujoco)
        except (ValueError, OSError) as error:
            raise fail(label, "", _refused(str(error))) from None
        _name_all(spec)
        _check_meshes(mujoco, spec, label)
        _leave_meshes_out(mujoco, spec)
        spec.compiler.fusestatic = False
        findings += _possible_moments(spec, label)
        made = Compiled(None, spec, findings=findings)
        made.model = _compile(spec, made, label)
    return made


def _refused(error: str) -> str:
    """The message, on one line, that MuJoCo cannot read the file, with its reason."""
    text = " ".join(error.split())
    text = re.sub(r"^(XML )?Error: ", "", text)
    return f"MuJoCo cannot read it: {text[:1].lower() + text[1:]}"


def _name_all(spec: Any) -> None:
    """Give every body and joint a name, those of the file staying as they are."""
    taken = {body.name for body in spec.bodies}
    for number, body in enumerate(spec.bodies):
        if not body.name:
            body.name = _free_name(f"body-{number}", taken)
    taken = {joint.name for joint in spec.joints}
    for body in spec.bodies:
        for place, joint in enumerate(body.joints, start=1):
            if not joint.name:
                alone = len(body.joints) == 1
                joint.name = _free_name(body.name if alone else f"{body.name}-{place}", taken)


def _free_name(name: str, taken: set[str]) -> str:
    """The name, or with -2, -3, ... after it where it is taken; it joins `taken`."""
    made, count = name, 2
    while made in taken:
        made, count = f"{name}-{count}", count + 1
    taken.add(made)
    return made


def _meshed(mujoco: Any, geom: Any) -> bool:
    return geom.type in [getattr(mujoco.mjtGeom, kind) for kind in MESH_KINDS] or bool(geom.meshname)


def _check_meshes(mujoco: Any, spec: Any, label: str) -> None:
    """Refuse a mass that only a mesh knows: meshes are not read."""
    always = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    faults = []
    for body in _moving(spec):
        if body.explicitinertial and not always:
            continue
        meshes = [g.meshname for g in body.geoms if _meshed(mujoco, g) and (g.density > 0.0 or g.mass > 0.0)]
        if meshes and all(np.isnan(g.mass) or g.mass > 0.0 for g in body.geoms):
            faults.append(
                Fault(
                    label,
                    f"body '{body.name}'",
                    f"has its mass from the mesh '{meshes[0]}', and meshes are not read; give it an <inertial> "
                    "with mass, pos and fullinertia (MuJoCo writes them with saveinertial)",
                )
            )
    if faults:
        raise DeviceError(faults)


def _moving(spec: Any) -> Iterator[Any]:
    """The bodies that some joint moves; of others no mass is asked."""
    waiting = [(spec.worldbody, False)]
    while waiting:
        body, moves = waiting.pop()
        moves = moves or bool(len(body.joints))
        if moves:
            yield body
        waiting += [(child, moves) for child in body.bodies]


def _leave_meshes_out(mujoco: Any, spec: Any) -> None:
    """Replace meshes by small spheres and remove materials of a model, so that no other file is read."""
    for geom in spec.geoms:
        if _meshed(mujoco, geom) or geom.hfieldname:
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_SPHERE, [0.01, 0.01, 0.01]
            geom.meshname, geom.hfieldname, geom.mass = "", "", 0.0
        geom.material = ""
    for site in spec.sites:
        site.material = ""
    for tendon in spec.tendons:
        tendon.material = ""
    for group in ASSETS:
        for element in list(getattr(spec, group, [])):
            delete = getattr(spec, "delete", None)  # elements delete themselves in MuJoCo 3.3.0
            delete(element) if delete else element.delete()


def _possible_moments(spec: Any, label: str) -> list[Finding]:
    """Lower a largest moment that is above the sum of the other two to that sum, and tell it; MuJoCo would refuse
    it. Raises DeviceError for negative ones."""
    found, faults = [], []
    for body in spec.bodies:
        if not body.explicitinertial or spec.compiler.balanceinertia:
            continue
        full, axes = not np.isnan(body.fullinertia[0]), np.eye(3)
        moments = np.array(body.inertia)
        if full:
            moments, axes = np.linalg.eigh(matrix_of_six(body.fullinertia))
        place, rest = int(np.argmax(moments)), float(moments.sum() - moments.max())
        listed = ", ".join(f"{moment:.6g}" for moment in sorted(moments))
        where, what = f"body '{body.name}'", f"has the principal moments of inertia {listed} kg m²"
        if moments.min() < -ROUNDED * moments.max():
            faults.append(Fault(label, where, f"{what}; no body has a negative one: correct its inertia"))
        elif moments[place] > rest:
            if moments[place] > rest * (1.0 + ROUNDED):
                told = "no body has one above the sum of the other two"
                found.append(Finding(where, f"{what}; {told}, {rest:.6g}, which is taken", WARNING))
            moments[place] = rest * (1.0 - 1e-14)
            if not full:
                body.inertia = moments
            else:
                body.fullinertia = six_of_matrix(axes @ np.diag(moments) @ axes.T)
    if faults:
        raise DeviceError(faults)
    return found


def matrix_of_six(six: Any) -> Any:
    """Symmetric inertia matrix (3, 3) of Ixx, Iyy, Izz, Ixy, Ixz, Iyz, as MuJoCo orders them."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def six_of_matrix(matrix: Any) -> Any:
    """Ixx, Iyy, Izz, Ixy, Ixz, Iyz of a matrix."""
    return [matrix[i][j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def _compile(spec: Any, made: Compiled, label: str) -> Any:
    """Compile, giving a mass to bodies that have none and move: MuJoCo wants one."""
    for body in spec.bodies:
        if len(body.joints) and body.explicitinertial and body.mass < LEAST:
            _weigh(body, made.massless)
        elif len(body.joints) and not body.explicitinertial and not len(body.geoms):
            _weigh(body, made.unknown)
    for _ in range(len(spec.bodies) + 1):
        try:
            return spec.compile()
        except ValueError as error:
            named = re.search(r"Element name '(.*)', id (\d+)", str(error))
            if "mass and inertia of moving bodies" in str(error) and named:
                body = spec.bodies[int(named[2])]
                _weigh(body, made.massless if body.explicitinertial else made.unknown)
                continue
            raise fail(label, "", _refused(str(error))) from None
    raise fail(label, "", "has bodies without mass that MuJoCo does not take; give each an <inertial>")


def _weigh(body: Any, names: set[str]) -> None:
    """Give a body a mass, without which MuJoCo does not compile it, and add its name to `names`."""
    names.add(body.name)
    body.explicitinertial, body.mass, body.inertia = True, 1.0, [1.0, 1.0, 1.0]
    body.fullinertia = [np.nan, 0.0, 0.0, 0.0, 0.0, 0.0]


def mjcf_file(path: Path) -> Callable[[Any], Any]:
    """A function that, given the package mujoco, reads this file, and those that it includes, as a MjSpec."""
    return lambda mujoco: mujoco.MjSpec.from_file(str(path))


def xml_text(text: str) -> Callable[[Any], Any]:
    """A function that, given the package mujoco, reads this text as a MjSpec."""
    return lambda mujoco: mujoco.MjSpec.from_string(text)
