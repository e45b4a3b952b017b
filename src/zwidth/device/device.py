"""A device as loaded: what was given, and the way from a posture to the rendered direction's plant."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from math import nan, pi
from numbers import Real
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from zwidth.device.build import in_space
from zwidth.device.faults import DeviceError, fail, quote, suggestion
from zwidth.loop.controller import Controller
from zwidth.model.drive_parts import of_drives
from zwidth.model.mechanism import Floats, Mechanism
from zwidth.model.nonlinear import Nonlinear
from zwidth.model.plant import Plant
from zwidth.model.response import Response

if TYPE_CHECKING:
    from zwidth.model.damping import Damping
    from zwidth.model.operator import Operator
    from zwidth.model.posture import Posture
    from zwidth.model.reduction import Encoders, Model

MODELS: Final = ("full", "two-mass", "motor-mass", "rigid")
PROJECTED: Final = 0.01  # of the arm's length, within which a position is projected onto what the handle has
# Where the handle is: x, y or x, y, z [m], or the angle of every driven joint by the name of its link [rad].
At = Sequence[float] | Mapping[str, float]


@dataclass(frozen=True)
class Device:
    """A haptic device: a mechanism or a given plant, and the computer that closes the loop.

    name, description, source   as in the file
    sources             dotted path -> where that group of numbers comes from
    label               the file or bundled name, for messages
    mechanism           None for a device given by its plant
    given_plant         None for a device given by its mechanism or response
    response            the measured response; None for a device given by a model
    controller          sampling, delay, velocity filter
    damping             how the mechanism's flexible modes are damped
    reference_position  (3,) handle position meant where none is given [m]; None for a plant
    reference_direction (3,) rendered direction meant where none is given, any length; None for a plant
    reference_assembly  assembly meant where none is given; None for a plant
    operator            the arm and grasp at the handle; None: nobody
    operator_name       what he is called; None: nobody
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
    encoders: Encoders
    document: dict[str, Any]

    @property
    def by_response(self) -> bool:
        """Is the device charted by its frequency response: a measured one, or that of a loss factor?"""
        hysteretic = self.given_plant is not None and self.given_plant.hysteresis is not None
        return self.response is not None or hysteretic

    @property
    def left_out(self) -> tuple[str, ...]:
        """What of the device a linear answer leaves out, in words; () if it leaves out nothing."""
        found = Nonlinear() if self.given_plant is None else self.given_plant.nonlinear
        if self.mechanism is not None:
            drives = self.mechanism.drives
            each = np.eye(len(drives.names))
            found = of_drives(drives, np.ones(len(each)), 0.0 * each, each, each)
        limit = min(found.force_limit, self.controller.saturation)
        return replace(found, force_limit=limit).left_out

    @property
    def friction_known(self) -> bool:
        """Does the file tell the dry friction, be it 0?"""
        mechanism = self.document.get("mechanism", {})
        return "friction" in self.document or any("coulomb_Nm" in d for d in mechanism.get("drives", ()))

    @property
    def steps_known(self) -> bool:
        """Does the file tell the encoders' steps, be they 0? Of a mechanism it has to tell them all."""
        if self.mechanism is not None:
            return bool(np.isfinite(self.mechanism.drives.encoder_counts).all())
        return self.document.get("loop", {}).get("encoder", {}).get("resolution_m") is not None

    def posture(self, at: At | None = None, assembly: str | None = None) -> Posture:
        """The mechanism with its handle at a position, in a named assembly (left out: those of the file).

        A position that the handle misses by 1 % of the arm's length or less is projected onto the nearest that it
        has; `Posture.projected` says how far.

        at      x, y or x, y, z [m], or the driven joints' angles (see `position`)
        Raises  DeviceError    if the device has no mechanism, the arguments cannot be meant, or the mechanism
                               cannot be assembled or driven as the file says
                PostureError   (model.posture) where there is no answer: out of reach, or singular
        """
        mechanism = self._mechanism(at=at, assembly=assembly)
        position = self.position(at, assembly)
        from zwidth.model.posture import solve_posture

        with self._solving(assembly) as name:
            return solve_posture(mechanism, position, name, tolerance=PROJECTED)

    @contextmanager
    def _solving(self, assembly: str | None) -> Iterator[str | None]:
        """The name of the assembly, and what goes wrong in it as faults of the file where it is one."""
        mechanism = self._mechanism(assembly=assembly)
        if assembly is not None and assembly not in mechanism.assemblies:
            message = f"names no assembly, got '{assembly}'; {suggestion(assembly, set(mechanism.assemblies))}"
            raise fail(self.label, "assembly", message)
        name = assembly or self.reference_assembly
        from zwidth.model.posture import LoopOpen, PostureError

        try:
            yield name
        except LoopOpen as error:
            raise fail(self.label, f"mechanism.assemblies.{name}", str(error)) from None
        except PostureError:
            raise
        except ValueError as error:  # drives that do not fit the mechanism
            raise fail(self.label, "mechanism", str(error)) from None

    def plant(
        self,
        at: At | None = None,
        direction: Sequence[float] | None = None,
        assembly: str | None = None,
        model: str | None = None,
        *,
        held: bool = True,
    ) -> Plant:
        """The rendered direction's dynamics at a posture, in one of the models, with the operator at its handle.

        at, direction   x, y or x, y, z [m], [1]; at may be the driven joints' angles, a direction of any length
                        but zero
        model           "full", "two-mass", "motor-mass" or "rigid"; left out: full for a mechanism, and a
                        given plant as it is
        held            False: the device by itself, without its operator. "motor-mass" holds the link side, and so
                        the operator, fixed: he does nothing to it
        Raises  DeviceError  if the arguments cannot be meant for this device
                ValueError   where the posture does not exist (PostureError), or the model
        """
        if model is not None and model not in MODELS:
            raise fail(self.label, "model", f"must be one of {', '.join(MODELS)}, got {quote(model)}")
        if self.response is not None:
            self._mechanism_only(at=at, direction=direction, assembly=assembly, model=model)
            raise fail(self.label, "", "has a measured [response] and no model; chart and check it")
        if self.given_plant is not None:
            self._mechanism_only(at=at, direction=direction, assembly=assembly)
            given = self._given(self.given_plant, model)
            if not held:
                return given
            return self._given_and_held if given is self.given_plant else self.hold(given)
        along = self.direction(direction)
        posture = self.posture(at, assembly)
        from zwidth.model.reduction import reduce_mechanism

        chosen = cast("Model", model or "full")
        plant = reduce_mechanism(self._mechanism(), posture, along, chosen, self.damping, self.encoders)
        return self.hold(plant) if held else plant

    @cached_property
    def _given_and_held(self) -> Plant:
        """The given plant with its operator: one object, so that a model that changes nothing is seen to."""
        assert self.given_plant is not None
        return self.hold(self.given_plant)

    def hold(self, plant: Plant) -> Plant:
        """A plant of this device with the operator at its handle.

        Returns  the plant itself where there is no operator, or no handle: a model that holds the link side fixed
                 holds the operator, too (a given plant without a handle takes no operator in the first place)
        """
        if self.operator is None or plant.handle is None:
            return plant
        from zwidth.model.operator import attach

        return attach(plant, self.operator)

    def position(self, at: At | None = None, assembly: str | None = None) -> Floats:
        """The handle's position meant, (3,) [m]; left out: that of the file.

        at  x, y or x, y, z [m]; x, y lies at the height of the file's reference, whose plane a planar device
            does not leave. Or the angle of every driven joint by the name of its link [rad], in the assembly
        Raises  DeviceError   if the arguments cannot be meant
                PostureError  (model.posture) for joints that cannot be turned to these angles
        """
        mechanism = self._mechanism(at=at)
        reference = self.reference_position
        assert reference is not None
        if at is None:
            return reference
        if isinstance(at, Mapping):
            from zwidth.model.posture import joint_position

            angles = self._angles(mechanism, at)
            with self._solving(assembly) as name:
                return joint_position(mechanism, angles, name)
        position = self._vector("at", at)
        return np.array([*position[:2], reference[2]]) if len(at) == 2 else position

    def direction(self, direction: Sequence[float] | None = None) -> Floats:
        """The rendered direction as a unit vector, (3,); left out: that of the file."""
        self._mechanism(direction=direction)
        vector = self.reference_direction if direction is None else self._vector("direction", direction)
        assert vector is not None
        largest = float(np.abs(vector).max())
        if largest == 0:
            raise fail(self.label, "direction", "has zero length; give any vector along it, such as 0,1")
        vector = vector / largest  # so that the squares neither overflow nor vanish
        return np.asarray(vector / np.linalg.norm(vector))

    def _angles(self, mechanism: Mechanism, at: Mapping[str, float]) -> dict[str, float]:
        """Angles of all driven joints by the names of their links, checked [rad]."""
        driven = [mechanism.links.names[joint] for joint in mechanism.drives.joint]
        if set(at) != set(driven):
            message = (
                f"must be the angle of every driven joint, {', '.join(driven)}, got {', '.join(map(str, at))}"
            )
            raise fail(self.label, "at", message)
        angles = {}
        for joint, value in at.items():
            angle = float(value) if isinstance(value, Real) else nan
            if not abs(angle) <= 2.0 * pi:
                message = (
                    f"{joint}: must be an angle from -2 pi to 2 pi rad, got {quote(value)}; is it in degrees?"
                )
                raise fail(self.label, "at", message)
            angles[joint] = angle
        return angles

    def _given(self, plant: Plant, model: str | None) -> Plant:
        if model in (None, "full"):
            return plant
        from zwidth.model.reduction import reduce_plant

        return reduce_plant(plant, cast("Model", model))

    def _mechanism(self, **given: object) -> Mechanism:
        """The mechanism, or the reason why these arguments do not apply to a given plant."""
        if self.mechanism is None:
            self._mechanism_only(**given)
            raise fail(self.label, "", f"has a {self._kind} and no [mechanism]; it has no postures or directions")
        return self.mechanism

    def _mechanism_only(self, **given: object) -> None:
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
        return "[response]" if self.response is not None else "[plant]"

    def _vector(self, name: str, value: Sequence[float]) -> Floats:
        try:
            components = [float(component) for component in value]
        except (TypeError, ValueError):
            raise fail(self.label, name, f"must be 2 or 3 numbers, got {quote(value)}") from None
        if len(components) not in (2, 3):
            raise fail(self.label, name, f"must be 2 or 3 numbers x, y or x, y, z, got {len(components)}")
        if not np.all(np.isfinite(components)):
            raise fail(self.label, name, f"must be finite, got {quote(components)}")
        return in_space(components)
