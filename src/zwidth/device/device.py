"""A device as loaded: what was given, and the way to its operating points."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from zwidth import _verbs
from zwidth.arrays import Floats
from zwidth.device.build import joint_angles, positions, rotations, screws, unit_vectors
from zwidth.device.faults import fail, quote, suggestion
from zwidth.device.plausibility import missing_numbers
from zwidth.errors import DeviceError
from zwidth.loop.controller import Controller
from zwidth.loop.linear_omissions import linear_omissions, load_omissions
from zwidth.model.mechanism import Mechanism
from zwidth.model.operator import ABOUT_AN_AXIS
from zwidth.model.plant import Plant
from zwidth.model.response import Response

if TYPE_CHECKING:
    from zwidth.chart.chart_base import Chart
    from zwidth.chart.verdict import WallVerdicts
    from zwidth.identify.identification import Identification
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.loop.posed_device import Position
    from zwidth.loop.wall_matrices import WallMatrices
    from zwidth.measures.definition import Measure, MeasureValues
    from zwidth.measures.description import Description
    from zwidth.model.arm import Arm
    from zwidth.model.load import Load
    from zwidth.model.mechanism import Damping
    from zwidth.model.operator import Operator
    from zwidth.model.posture import Posture
    from zwidth.model.reduction import Encoders, Model
    from zwidth.progress import Progress
    from zwidth.study.link_bending import Bending
    from zwidth.study.loaded_charts import LoadPath
    from zwidth.study.sensitivity.result import Sensitivities


@dataclass(frozen=True, repr=False)
class Device:
    """A haptic device: a mechanism or a given plant, and the computer that closes the loop.

    name, description, source   as in the file
    sources             dotted path -> where that group of numbers comes from
    label               the file or bundled name, for messages
    mechanism           None for a device given by its plant or response
    given_plant         None for a device given by its mechanism or response
    response            the measured response; None for a device given by a model
    controller          sampling, delay, velocity filter
    damping             how the mechanism's flexible modes are damped
    reference_position  (3,) handle position meant where none is given [m]; None for a plant
    reference_direction (3,) rendered direction meant where none is given, any length, or a screw (6,); None for a
                        plant
    reference_assembly  assembly meant where none is given; None for a plant
    operator            the arm and grasp at the handle; None: nobody
    arm                 his arm as a chain of bodies, in place of an operator's numbers; None: there is none
    operator_name       what he is called; None: nobody
    load                what the device bears while it renders; None: nothing
    encoders            what a mechanism's encoders read: "motor" or "link"
    document            the file's tables after settings: for saving, and for addressing its numbers
    """

    name: str
    description: str
    source: str
    sources: dict[str, str]
    label: str
    mechanism: Mechanism | None
    given_plant: Plant | None
    response: Response | None
    controller: Controller
    damping: Damping
    reference_position: Floats | None
    reference_direction: Floats | None
    reference_assembly: str | None
    operator: Operator | None
    operator_name: str | None
    arm: Arm | None
    load: Load | None
    encoders: Encoders
    document: dict[str, Any]

    def __repr__(self) -> str:
        """Name, kind, file and operator of the device, and its sampling on a second line."""
        kind = self._kind if self.mechanism is None else "[mechanism]"
        computer = self.controller.timing_text
        held = f", held by {self.operator_name}" if self.operator_name else ""
        return f"Device {self.name!r}, {kind} from {self.label}{held}\n  {computer}"

    @property
    def friction_known(self) -> bool:
        """Whether the file gives the dry friction, 0 included."""
        mechanism = self.document.get("mechanism", {})
        return "friction" in self.document or any("coulomb_Nm" in drive for drive in mechanism.get("drives", ()))

    @property
    def resolution_known(self) -> bool:
        """Whether the file gives the encoders' steps, 0 included; those of all drives for a mechanism."""
        if self.mechanism is not None:
            return bool(np.isfinite(self.mechanism.drives.encoder_counts).all())
        return self.document.get("loop", {}).get("encoder", {}).get("resolution_m") is not None

    @cached_property
    def missing(self) -> dict[str, tuple[str, ...]]:
        """Keys that the file leaves out as not known, by what needs them: "dynamics", "sampling"."""
        return missing_numbers(self.document)

    @property
    def linear_omissions(self) -> tuple[str, ...]:
        """Parts of the device that a linear answer leaves out, in words; () if there are none."""
        return linear_omissions(self.mechanism, self.given_plant, self.controller)

    def omissions(self, model: str | None = None) -> tuple[str, ...]:
        """What a linear answer leaves out, in words: the same, and what it leaves out of the load.

        model  "rigid" has no links that bend
        """
        return self.linear_omissions + load_omissions(self.mechanism, self.load, model)

    def at(
        self,
        position: Position | ArrayLike | Posture | None = None,
        direction: ArrayLike | None = None,
        *,
        axis: ArrayLike | None = None,
        characteristic_length: float | None = None,
        directions: ArrayLike | None = None,
        relative_stiffness: ArrayLike | None = None,
        relative_damping: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        assembly: str | None = None,
        model: str | None = None,
        operator: Operator | str | os.PathLike[str] | None = None,
        load: Load | ArrayLike | None = None,
        gravity: ArrayLike | None = None,
    ) -> OperatingPoint:
        """The device with its handle at a position, rendering a direction: where it is linearised.

            device.at((0.0, 0.25), (0.0, 1.0)).chart()

        A single position that the handle misses by 1 % of the arm's length or less is projected onto one
        that it has, found by descent; `point.posture.projected` says how far. In a batch a position that cannot
        be had is marked in `point.status`.

        position    (..., 2) or (..., 3) [m]; x, y lies at the height of the file's reference, whose plane a planar
                    device does not leave. Or the angle of every driven joint by the name of its link [rad], or a
                    posture solved before: as it is, or under load as it was asked for. Left out: the file's
                    reference
        direction   (..., 2) or (..., 3) of any length but zero; its leading axes broadcast with those of the
                    position. Left out: the file's
        axis        (..., 3) of any length instead: the axis about which moments are rendered; walls then are in
                    N m/rad. With a direction: a screw, as much of either as the vectors are long
        characteristic_length  by which angles count as ways on a screw [m]
        directions  (..., m, 2) or (..., m, 3) instead: directions rendered together, under one wall law; or
                    (..., m, 6) screws, see `model.effective_parameters.screw`
        relative_stiffness, relative_damping   of that law along each of these directions (m,), or as a matrix
                    (m, m), symmetric and positive semidefinite: f = -(k K0 y + b B0 v). Only ratios count, so that
                    k and b are those of the stiffest, and of the most damped direction. Stiffness left out: the
                    same along each; damping left out: as the stiffness
        orientation (..., 3) roll, pitch, yaw [rad] or (..., 3, 3) axes of the handle, where the drives control it;
                    left out: the file's
        assembly    name of the way the mechanism is assembled; left out: the file's
        model       how much of the device is modelled: "full", "two-mass", "motor-mass" or "rigid"; left out: full
                    for a mechanism, and a given plant as it is. "motor-mass" holds the link side, and so the
                    operator, fixed: he does nothing to it
        operator    who holds the handle: an Operator, a bundled name or a file, "none"; left out: as the file says
        load        force of the hand on the handle (2,) or (3,) [N], about an axis its moment [N m], or a `Load`:
                    the device is linearised about the haptic equilibrium under it, see `docs/equilibrium.md`. Left
                    out: as the file says
        gravity     (2,) or (3,) [m/s²], with a load or without; left out: as the file says
        Raises  DeviceError   with what cannot be meant for this device, or a mechanism that cannot be assembled or
                              driven as the file says
                ArgumentError   (loop.wall_matrices) for what is no matrix of a wall law
                PostureError  (model.posture) where a single position has no posture: out of reach, or singular
                EquilibriumError, LoadError  (model.equilibrium) where a single position has no equilibrium
        """
        from zwidth.loop.operating_point import OperatingPoint
        from zwidth.model.reduction import MODELS

        if operator is not None or load is not None or gravity is not None:
            held = self if operator is None else self.held_by(operator)
            moment = held.renders_moments(direction, axis, characteristic_length)
            return held.under(load, gravity, moment=moment).at(
                position,
                direction,
                axis=axis,
                characteristic_length=characteristic_length,
                directions=directions,
                relative_stiffness=relative_stiffness,
                relative_damping=relative_damping,
                orientation=orientation,
                assembly=assembly,
                model=model,
            )
        if model is not None and model not in MODELS:
            raise fail(self.label, "model", f"must be one of {', '.join(MODELS)}, got {quote(model)}")
        if direction is not None and directions is not None:
            raise fail(self.label, "directions", "are given beside a direction; give one of the two")
        posture = rendered = requested_position = None
        if self.mechanism is None:
            refused = {} if self.response is None else {"model": model}
            self._refuse(
                at=position,
                direction=direction,
                axis=axis,
                directions=directions,
                orientation=orientation,
                assembly=assembly,
                **refused,
            )
        else:
            rendered = self._unit_directions(direction, axis, characteristic_length, directions)
            if self.operator is not None and rendered.shape[-1] == 6 and not rendered[..., :3].any():
                raise fail(self.label, "operator", ABOUT_AN_AXIS)
            posture = self._posture(position, orientation, assembly)
            shape = np.broadcast_shapes(posture.status.shape, rendered.shape[:-2])
            posture = posture.broadcast_to(shape)
            rendered = np.broadcast_to(rendered, (*shape, *rendered.shape[-2:]))
            posture = self._posture_under_load(posture, rendered, model)
            requested_position = self._requested_position(position)
        return OperatingPoint(
            controller=self.controller,
            mechanism=self.mechanism,
            posture=posture,
            directions=rendered,
            wall_matrices=self._wall_matrices(directions, rendered, relative_stiffness, relative_damping),
            given_plant=self.given_plant,
            response=self.response,
            model=cast("Model | None", model or ("full" if self.mechanism is not None else None)),
            damping=self.damping,
            encoders=self.encoders,
            operator=self.operator,
            operator_name=self.operator_name,
            arm=self.arm,
            friction_known=self.friction_known,
            resolution_known=self.resolution_known,
            name=self.name,
            requested_position=requested_position,
            missing=self.missing,
            load=self.load,
        )

    def at_point(self, point: OperatingPoint) -> OperatingPoint:
        """This device at the operating point of another, a single one: the same requested position (or the same
        joint angles), directions, assembly and model. Raises what `at` raises."""
        if point.posture is None:
            return self.at(model=point.model)
        asked = point.posture.asked or point.posture
        return self.at(
            point.requested_position,
            directions=point.directions,
            relative_stiffness=None if point.wall_matrices is None else point.wall_matrices.stiffness,
            relative_damping=None if point.wall_matrices is None else point.wall_matrices.damping,
            orientation=None if isinstance(point.requested_position, Mapping) else asked.rotation,
            assembly=point.posture.assembly,
            model=point.model,
        )

    def held_by(self, operator: Operator | str | os.PathLike[str]) -> Device:
        """The device with another operator at its handle.

        operator  an Operator, a bundled name, a file with an [operator], or "none"

        Raises  DeviceError  with all faults
        """
        return _verbs.device_held_by(self, operator)

    def under(
        self, load: Load | ArrayLike | None = None, gravity: ArrayLike | None = None, *, moment: bool = False
    ) -> Device:
        """The device under another load, about which all that is asked of it is linearised.

            device.under((0.0, -5.0)).chart()

        load     force of the hand on the handle (2,) or (3,) [N], or a `Load`; None: as it is
        gravity  (2,) or (3,) [m/s²]; None: as it is
        moment   whether three numbers are a moment [N m], of a wall about an axis
        Raises   DeviceError  for what is no load, and for a device without a mechanism
        """
        return _verbs.device_under(self, load, gravity, moment)

    @property
    def pushed_along_every_direction(self) -> Device:
        """The device under a push as strong as its load, along whatever direction is rendered; itself without a
        load."""
        return self if self.load is None else self.under(self.load.along_every_direction)

    def chart(self, radius: float = 1.0, *, decay: bool = True) -> Chart:
        """The stable walls at the device's reference; `device.at(...).chart()` elsewhere. See `chart_at`."""
        return self.at().chart(radius, decay=decay)

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> WallVerdicts:
        """Verdicts on walls at the device's reference; see `OperatingPoint.check`."""
        return self.at().check(wall_stiffness, wall_damping)

    def describe(self) -> Description:
        """Masses, stiffness, frequencies and dexterity at the device's reference."""
        return self.at().describe()

    def measure(
        self,
        measure: str | Measure,
        *,
        stiffness: float | None = None,
        damping: float | None = None,
        frequency: float | None = None,
    ) -> MeasureValues:
        """A measure by its name, or one of your own, at the device's reference; see `OperatingPoint.measure`."""
        return self.at().measure(measure, stiffness=stiffness, damping=damping, frequency=frequency)

    def sensitivities(
        self, point: OperatingPoint | None = None, progress: Progress | None = None
    ) -> Sensitivities:
        """How the largest stiffness answers to each number of the device; see `study.sensitivity`.

        point  where: `device.at(...)`; left out: the reference
        """
        point = point or self.at()
        return _verbs.device_sensitivities(self, point, progress).about(point)

    def load_path(
        self,
        push: float = 5.0,
        count: int = 9,
        *,
        point: OperatingPoint | None = None,
        progress: Progress | None = None,
    ) -> LoadPath:
        """How the chart moves with the hand's push along the rendered direction; see `study.load.load_path`.

            device.load_path(push=5.0).stiffness_max

        push   largest push to either side [N], about an axis [N m]
        count  number of pushes, odd
        point  where, and under which load otherwise: `device.at(...)`; left out: the reference, and the file's
        """
        return _verbs.device_load_path(self, push, count, point, progress)

    def bending(self, point: OperatingPoint | None = None) -> Bending | None:
        """What it changes that links bend: this device beside the same with rigid links or, where the file gives
        no beams, with its links as typical tubes; see `study.load.bending.bending`. None where no link could bend.

        point  where: `device.at(...)`; left out: the reference
        """
        return _verbs.device_bending(self, point)

    def identify(
        self,
        kind: str,
        records: Any,
        *,
        point: OperatingPoint | None = None,
        progress: Progress | None = None,
        **options: Any,
    ) -> Identification:
        """Numbers of this device from measurements of it, each with its 95 % interval; see `identify.kinds`.

            found = device.identify("stiffness", "strokes.csv", joint="upper-right")
            measured = device.with_(found.settings)

        kind     "stiffness" and others, see `identify.kinds.KINDS`
        records  a file (.csv, .mat), columns as a mapping or an xarray dataset; or a list of such, each a run
        point    where it was measured, for kinds that hang on it; left out: the reference
        options  of the kind
        """
        return _verbs.device_identify(self, kind, records, point, progress, options)

    def report(self, path: str | os.PathLike[str], point: OperatingPoint | None = None) -> dict[str, Any]:
        """Write everything about the device into one HTML file; returns the numbers in it. See `write_report`.

        point  where: `device.at(...)`; left out: the reference
        """
        return _verbs.device_report(self, path, point or self.at())

    def with_(self, settings: Mapping[str, Any] | Sequence[str | tuple[str, Any]]) -> Device:
        """The device with other numbers, checked as a file is; the device itself stays as it is.

            device.with_({"loop.delay_samples": 1, "links.upper.length_m": 0.15})

        settings  path -> value; or "PATH=VALUE" texts and (path, value) pairs, see `address.apply`
        Raises  DeviceError  with all the faults of the settings, or else of the device they make
                TypeError    for settings of another kind
        """
        return _verbs.device_with(self, settings)

    def position(self, position: Position | ArrayLike | None = None, assembly: str | None = None) -> Floats:
        """The requested position of the handle, (..., 3) [m]; left out: that of the file.

        position, assembly  as for `at`; the assembly counts for joint angles alone
        Raises  DeviceError   for arguments that do not apply to this device
                PostureError  (model.posture) for joints that cannot be turned to these angles
        """
        mechanism = self._mechanism(at=position)
        assert self.reference_position is not None
        if position is None:
            return self.reference_position
        if isinstance(position, Mapping):
            from zwidth.model.posture import place_of_joints

            angles = joint_angles(self.label, mechanism, position)
            with self.solving(assembly) as name:
                return place_of_joints(mechanism, angles, name)[0]
        return positions(self.label, position, float(self.reference_position[2]))

    def direction(
        self,
        direction: ArrayLike | None = None,
        axis: ArrayLike | None = None,
        characteristic_length: float | None = None,
    ) -> Floats:
        """The rendered direction as a unit vector, (..., 3), or with an axis as a screw, (..., 6); left out: that
        of the file. Arguments as for `at`. Raises DeviceError."""
        self._mechanism(direction=direction, axis=axis)
        if axis is not None:
            return screws(self.label, direction, axis, characteristic_length)
        if characteristic_length is not None:
            raise fail(self.label, "characteristic_length", "is of a direction and an axis together; leave it out")
        given = self.reference_direction if direction is None else direction
        if isinstance(given, np.ndarray) and given.shape[-1:] == (6,):  # a screw, made before
            return given
        return unit_vectors(self.label, "direction", given)

    def renders_moments(
        self,
        direction: ArrayLike | None = None,
        axis: ArrayLike | None = None,
        characteristic_length: float | None = None,
    ) -> bool:
        """Whether moments about an axis are rendered, so that stiffness is in N m/rad; arguments as for `at`."""
        if self.mechanism is None:
            return False
        rendered = self.direction(direction, axis, characteristic_length)
        # a screw, of which the part along a direction is 0
        return rendered.shape[-1] == 6 and not rendered[..., :3].any()

    def _posture_under_load(self, posture: Posture, directions: Floats, model: str | None) -> Posture:
        """The postures (...) that the device has under its load, rendering directions (..., 1, 3 or 6); those
        given where it has none, or renders several directions together."""
        if self.load is None or directions.shape[-2] != 1:
            return posture
        from zwidth.model.effective_mass import screw
        from zwidth.model.loaded_posture import loaded_postures

        assert self.mechanism is not None
        mechanism = self.mechanism.made_rigid if model == "rigid" else self.mechanism
        counts_motors = self.encoders == "motor"
        return loaded_postures(mechanism, posture, screw(directions[..., 0, :]), self.load, counts_motors)

    def _requested_position(self, position: Position | ArrayLike | Posture | None) -> Position | Floats | None:
        """The requested position that a point keeps, so that another device can be put there: (..., 3) [m], joint
        angles by name, or None for the reference.

        position  as for `at`; of a posture, under load, the position of the one that was asked for
        """
        from zwidth.model.posture import Posture

        if position is None or isinstance(position, Mapping):
            return position
        if not isinstance(position, Posture):
            return self.position(position)
        return position.position if self.load is None else (position.asked or position).position

    def _wall_matrices(
        self,
        directions: ArrayLike | None,
        rendered: Floats | None,
        relative_stiffness: ArrayLike | None,
        relative_damping: ArrayLike | None,
    ) -> WallMatrices | None:
        """The matrices of the wall law along directions rendered together; None where it is the same along each.

        directions  as the user gave them; None for one direction
        rendered    (..., m, 3) or (..., m, 6), the unit vectors or screws of all of them; None of a plant
        Raises  DeviceError  for a relative stiffness or damping without directions
        """
        from zwidth.loop.wall_matrices import WallMatrices

        given = {"relative_stiffness": relative_stiffness, "relative_damping": relative_damping}
        for name, value in given.items():
            if value is not None and (directions is None or rendered is None):
                raise fail(self.label, name, "is for directions rendered together; give directions, too")
        if (relative_stiffness is None and relative_damping is None) or rendered is None:
            return None
        return WallMatrices.of(relative_stiffness, relative_damping, rendered.shape[-2])

    def _unit_directions(
        self,
        direction: ArrayLike | None,
        axis: ArrayLike | None,
        characteristic_length: float | None,
        directions: ArrayLike | None,
    ) -> Floats:
        """Unit vectors (..., m, 3), or screws (..., m, 6), of the directions rendered together; m = 1 of a single
        direction. Arguments as for `at`; an array of screws stays as it is. Raises DeviceError."""
        if directions is None:
            return self.direction(direction, axis, characteristic_length)[..., None, :]
        if axis is not None:
            raise fail(self.label, "directions", "are given beside an axis; give screws of six numbers instead")
        if isinstance(directions, np.ndarray) and directions.shape[-1:] == (6,):
            return np.atleast_2d(directions)
        together = unit_vectors(self.label, "directions", directions)
        if together.ndim < 2 or not together.size:
            raise fail(self.label, "directions", "must be a list of directions, such as [(1, 0), (0, 1)]")
        return together

    def _posture(
        self, position: Position | ArrayLike | Posture | None, orientation: ArrayLike | None, assembly: str | None
    ) -> Posture:
        """The postures of a mechanism at handle positions, joint angles or postures. Raises DeviceError for an
        orientation that the drives do not control, or beside joint angles."""
        from zwidth.loop.posed_device import PROJECTION_TOLERANCE
        from zwidth.model.mechanism import POSITION
        from zwidth.model.posture import Posture, place_of_joints, solve_posture

        if isinstance(position, Posture):
            # a device without load takes it as it is
            return replace(position, asked=None) if self.load is None and position.asked else position
        mechanism = self._mechanism()
        if orientation is not None and mechanism.controls == POSITION:
            message = (
                "does not apply: the drives of this device control the position of its handle alone; leave it out"
            )
            raise fail(self.label, "orientation", message)
        axes = None if orientation is None else rotations(self.label, orientation)
        if isinstance(position, Mapping) and mechanism.controls != POSITION:
            if orientation is not None:
                raise fail(
                    self.label, "orientation", "is given beside joint angles, which determine it; leave it out"
                )
            angles = joint_angles(self.label, mechanism, position)
            with self.solving(assembly) as name:
                goal, axes = place_of_joints(mechanism, angles, name)
        else:
            goal = self.position(position, assembly)
        # a single position, as typed, is moved onto one that the handle has; of several none is
        single = goal.ndim == 1 and (axes is None or axes.ndim == 2) and not mechanism.design_shape
        with self.solving(assembly) as name:
            return solve_posture(
                mechanism, goal, name, orientation=axes, tolerance=PROJECTION_TOLERANCE if single else 0.0
            )

    @contextmanager
    def solving(self, assembly: str | None) -> Iterator[str | None]:
        """The name of an assembly, the reference's where it is None, for a block that finds postures in it; what
        goes wrong there is raised as DeviceError of the file where that is to blame. Raises DeviceError for a name
        that is none."""
        mechanism = self._mechanism(assembly=assembly)
        if assembly is not None and assembly not in mechanism.assemblies:
            known = set(mechanism.assemblies)
            message = (
                f"'{assembly}' is not an assembly of this device; {suggestion(assembly, known, 'assemblies')}"
            )
            raise fail(self.label, "assembly", message)
        name = assembly or self.reference_assembly
        from zwidth.errors import LoopOpen, PostureError

        try:
            yield name
        except LoopOpen as error:
            raise fail(self.label, f"mechanism.assemblies.{name}", str(error)) from None
        except PostureError:
            raise
        except ValueError as error:  # drives that do not fit the mechanism
            raise fail(self.label, "mechanism", str(error)) from None

    def _mechanism(self, **given: object) -> Mechanism:
        """The mechanism. Raises DeviceError where there is none, for the arguments that are given (not None) and
        do not apply."""
        if self.mechanism is None:
            self._refuse(**given)
            raise fail(self.label, "", f"has a {self._kind} and no [mechanism]; it has no postures or directions")
        return self.mechanism

    def _refuse(self, **given: object) -> None:
        """Raise DeviceError for all arguments, by name, that are given (not None) and so do not apply to a device
        of this kind."""
        named = [name for name, value in given.items() if value is not None]
        if named:
            raise DeviceError(
                fail(
                    self.label, name, f"does not apply to a device given by its {self._kind}; leave it out"
                ).faults[0]
                for name in named
            )

    @property
    def _kind(self) -> str:
        """The table that describes a device without mechanism, as users write it."""
        return "[response]" if self.response is not None else "[plant]"
