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
    """Collect what MuJoCo warns of inside the block as findings in the list `into`; it would print it, and write a
    file beside."""

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
            raise fail(label, "", _refusal_message(str(error))) from None
        _name_all(spec)
        _refuse_mesh_masses(mujoco, spec, label)
        _leave_meshes_out(mujoco, spec)
        spec.compiler.fusestatic = False
        findings += _lower_impossible_moments(spec, label)
        made = Compiled(None, spec, findings=findings)
        made.model = _compile(spec, made, label)
    return made


def _refusal_message(error: str) -> str:
    """The message, on one line, that MuJoCo cannot read the file, with its reason."""
    text = " ".join(error.split())
    text = re.sub(r"^(XML )?Error: ", "", text)
    return f"MuJoCo cannot read it: {text[:1].lower() + text[1:]}"


def _name_all(spec: Any) -> None:
    """Give every body and joint a name, those of the file staying as they are."""
    taken = {body.name for body in spec.bodies}
    for index, body in enumerate(spec.bodies):
        if not body.name:
            body.name = _free_name(f"body-{index}", taken)
    taken = {joint.name for joint in spec.joints}
    for body in spec.bodies:
        for number, joint in enumerate(body.joints, start=1):
            if not joint.name:
                only_joint = len(body.joints) == 1
                joint.name = _free_name(body.name if only_joint else f"{body.name}-{number}", taken)


def _free_name(name: str, taken: set[str]) -> str:
    """The name, or with -2, -3, ... after it where it is taken; it joins `taken`."""
    made, count = name, 2
    while made in taken:
        made, count = f"{name}-{count}", count + 1
    taken.add(made)
    return made


def _is_mesh(mujoco: Any, geom: Any) -> bool:
    """Whether a geometry takes its shape from a file of points: a mesh, a height field or a distance field."""
    return geom.type in [getattr(mujoco.mjtGeom, kind) for kind in MESH_KINDS] or bool(geom.meshname)


def _refuse_mesh_masses(mujoco: Any, spec: Any, label: str) -> None:
    """Raise DeviceError for bodies that move and whose mass only a mesh knows: meshes are not read."""
    always_from_geoms = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    faults = []
    for body in _moving_bodies(spec):
        if body.explicitinertial and not always_from_geoms:
            continue
        meshes = [
            geom.meshname
            for geom in body.geoms
            if _is_mesh(mujoco, geom) and (geom.density > 0.0 or geom.mass > 0.0)
        ]
        # where a shape of the body has the mass 0, its meshes are taken to be for the looks
        if meshes and all(np.isnan(geom.mass) or geom.mass > 0.0 for geom in body.geoms):
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


def _moving_bodies(spec: Any) -> Iterator[Any]:
    """The bodies that some joint moves; of others no mass is asked."""
    waiting = [(spec.worldbody, False)]
    while waiting:
        body, moves = waiting.pop()
        moves = moves or bool(len(body.joints))
        if moves:
            yield body
        waiting += [(child, moves) for child in body.bodies]


def _leave_meshes_out(mujoco: Any, spec: Any) -> None:
    """Replace meshes and height fields by small spheres and remove materials of a model, so that no other file
    is read."""
    for geom in spec.geoms:
        if _is_mesh(mujoco, geom) or geom.hfieldname:
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


def _lower_impossible_moments(spec: Any, label: str) -> list[Finding]:
    """Lower a largest principal moment that is above the sum of the other two to that sum, and return findings
    that tell it where it is more than rounding; MuJoCo would refuse it. Raises DeviceError for negative ones."""
    findings, faults = [], []
    for body in spec.bodies:
        if not body.explicitinertial or spec.compiler.balanceinertia:
            continue
        has_matrix, axes = not np.isnan(body.fullinertia[0]), np.eye(3)
        moments = np.array(body.inertia)
        if has_matrix:
            moments, axes = np.linalg.eigh(matrix_of_six(body.fullinertia))
        largest, sum_of_others = int(np.argmax(moments)), float(moments.sum() - moments.max())
        listed = ", ".join(f"{moment:.6g}" for moment in sorted(moments))
        where, what = f"body '{body.name}'", f"has the principal moments of inertia {listed} kg m²"
        if moments.min() < -ROUNDED * moments.max():
            faults.append(Fault(label, where, f"{what}; no body has a negative one: correct its inertia"))
        elif moments[largest] > sum_of_others:
            if moments[largest] > sum_of_others * (1.0 + ROUNDED):
                told = "no body has one above the sum of the other two"
                findings.append(Finding(where, f"{what}; {told}, {sum_of_others:.6g}, which is taken", WARNING))
            moments[largest] = sum_of_others * (1.0 - 1e-14)  # below the sum in MuJoCo's rounding, too
            if not has_matrix:
                body.inertia = moments
            else:
                body.fullinertia = six_of_matrix(axes @ np.diag(moments) @ axes.T)
    if faults:
        raise DeviceError(faults)
    return findings


def matrix_of_six(six: Any) -> Any:
    """Symmetric inertia matrix (3, 3) of Ixx, Iyy, Izz, Ixy, Ixz, Iyz, as MuJoCo orders them."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def six_of_matrix(matrix: Any) -> Any:
    """Ixx, Iyy, Izz, Ixy, Ixz, Iyz of a matrix."""
    return [matrix[i][j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def _compile(spec: Any, made: Compiled, label: str) -> Any:
    """Compile to an MjModel, giving a mass to bodies that have none and move, which MuJoCo wants; their names are
    added to `made`. Raises DeviceError for what MuJoCo refuses."""
    for body in spec.bodies:
        if len(body.joints) and body.explicitinertial and body.mass < LEAST:
            _give_placeholder_mass(body, made.massless)
        elif len(body.joints) and not body.explicitinertial and not len(body.geoms):
            _give_placeholder_mass(body, made.unknown)
    # MuJoCo names one body without mass at a time, by its number
    for _ in range(len(spec.bodies) + 1):
        try:
            return spec.compile()
        except ValueError as error:
            named = re.search(r"Element name '(.*)', id (\d+)", str(error))
            if "mass and inertia of moving bodies" in str(error) and named:
                body = spec.bodies[int(named[2])]
                _give_placeholder_mass(body, made.massless if body.explicitinertial else made.unknown)
                continue
            raise fail(label, "", _refusal_message(str(error))) from None
    raise fail(label, "", "has bodies without mass that MuJoCo does not take; give each an <inertial>")


def _give_placeholder_mass(body: Any, names: set[str]) -> None:
    """Give a body a mass of 1 kg, without which MuJoCo does not compile it, and add its name to `names`, by which
    the mass is left out of the robot."""
    names.add(body.name)
    body.explicitinertial, body.mass, body.inertia = True, 1.0, [1.0, 1.0, 1.0]
    body.fullinertia = [np.nan, 0.0, 0.0, 0.0, 0.0, 0.0]


def mjcf_file(path: Path) -> Callable[[Any], Any]:
    """A function that, given the package mujoco, reads this file, and those that it includes, as a MjSpec."""
    return lambda mujoco: mujoco.MjSpec.from_file(str(path))


def xml_text(text: str) -> Callable[[Any], Any]:
    """A function that, given the package mujoco, reads this text as a MjSpec."""
    return lambda mujoco: mujoco.MjSpec.from_string(text)
