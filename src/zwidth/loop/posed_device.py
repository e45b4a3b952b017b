"""A device in one posture or in many: the data of an operating point, and what its mechanism is like there.

An operating point in words: a line of its own, its errors, and what several directions together leave out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, Self, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats
from zwidth.errors import (
    EquilibriumError,
    MissingNumbersError,
    NoMechanismError,
    OperatingPointError,
    OperatorError,
    SeveralDirectionsError,
)
from zwidth.loop.controller import Controller
from zwidth.loop.wall_matrices import WallMatrices
from zwidth.model.argument_checks import check_choice
from zwidth.model.arm import Arm
from zwidth.model.design_axes import Change, at_index, change_fields, design_shape, differing_fields, in_one_axis
from zwidth.model.effective_mass import (
    DriveSide,
    EffectiveParameters,
    drive_side,
    effective_parameters,
    lever_arms,
    screw,
)
from zwidth.model.equilibrium import Equilibrium, solve_equilibrium
from zwidth.model.load import Load, unit_of_push
from zwidth.model.loaded_posture import loaded_postures
from zwidth.model.mechanism import Damping, Drives, GivenDamping, Mechanism, drives_at
from zwidth.model.mechanism_arrays import pack
from zwidth.model.motions import Motions
from zwidth.model.operator import ABOUT_AN_AXIS, Operator
from zwidth.model.plant import Plant
from zwidth.model.posture import OK, Posture, handle_motions, handle_range, solve_posture
from zwidth.model.reduction import Encoders, Model, plant_effective_parameters
from zwidth.model.response import Response

if TYPE_CHECKING:
    from zwidth.loop.measured.plant_fit import PlantFit
    from zwidth.loop.operating_point import OperatingPoint


# Where the handle is: x, y or x, y, z [m], or the angle of every driven joint by the name of its link [rad].
Position: TypeAlias = Sequence[float] | Mapping[str, float]

_OF_DESIGNS: Final = ("mechanism", "given_plant", "controller", "damping", "operator")

# Share of the arm's length within which a single position is projected onto one that the handle has.
PROJECTION_TOLERANCE: Final = 0.01


@dataclass(frozen=True, repr=False)
class PosedDevice:
    """A device in one posture or in many, rendering one direction or several at once in each, and its operator.

    Exactly one of mechanism, given_plant and response is given. A mechanism comes with postures and directions,
    whose leading axes are `shape`; a given plant and a response have one posture, of shape (). Numbers of
    mechanism, plant, controller, damping and operator may have axes of designs (`model.design_axes`), which
    broadcast to `shape`, too.

    controller          the computer that closes the loop
    mechanism           links, joints, loops and drives
    posture             (...) solved postures
    directions          (..., m, 3) unit vectors, or (..., m, 6) screws (`model.effective_parameters.screw`) of
                        moments about an axis; the m directions of one posture are rendered together
    wall_matrices       of the law along directions rendered together; None: the same law along each
    given_plant         dynamics of the rendered direction, as given
    response            measured response from force command to reading
    model               "full", "two-mass", "motor-mass" or "rigid"; None: full, or the plant as given
    damping             of the mechanism's flexible modes
    encoders            what a mechanism's encoders read: "motor" or "link"
    operator            the arm and grasp at the handle; None: nobody
    arm                 his arm as a chain of bodies, in place of `operator`; None: there is none
    operator_name       the operator's name in results; None: nobody
    friction_known, resolution_known   whether the dry friction, and the encoders' step, are given, 0 included
    name                the device's name in results and figures
    requested_position  position as requested, before it was projected; None: the device's reference
    load                hand's force and gravity about whose balance the device is linearised; None: none
    fit                 how well given_plant stands for a measured response; None: it is no such plant
    missing             keys that the device file leaves out as not known, by what needs them: "dynamics",
                        "sampling"
    results             what several measures of these points share, once it is computed
    """

    controller: Controller
    mechanism: Mechanism | None = None
    posture: Posture | None = None
    directions: Floats | None = None
    wall_matrices: WallMatrices | None = None
    given_plant: Plant | None = None
    response: Response | None = None
    model: Model | None = None
    damping: Damping = field(default_factory=GivenDamping)
    encoders: Encoders = "motor"
    operator: Operator | None = None
    operator_name: str | None = None
    arm: Arm | None = None
    friction_known: bool = True
    resolution_known: bool = True
    name: str = ""
    requested_position: Position | Floats | None = None
    missing: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    load: Load | None = None
    fit: PlantFit | None = None
    results: dict[Any, Any] = field(init=False, default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        """Raise ValueError for arguments that exclude or do not fit each other, and for encoders of no such name,
        OperatorError for a hand about an axis."""
        check_choice("encoders", self.encoders, get_args(Encoders))
        kinds = (self.mechanism, self.given_plant, self.response)
        if sum(kind is not None for kind in kinds) != 1:
            raise ValueError(
                "an operating point takes exactly one of mechanism, given_plant and response, got "
                f"{sum(kind is not None for kind in kinds)} of them; device.at() gives an operating point"
            )
        if (self.mechanism is None) != (self.posture is None) or (self.posture is None) != (
            self.directions is None
        ):
            raise ValueError("postures and directions come together, with a mechanism and not without one")
        if self.operator is not None and self.turns:
            raise OperatorError(f"the operator {ABOUT_AN_AXIS}")
        if self.load is not None and self.mechanism is None:
            raise ValueError("a load needs a mechanism, whose forces turn as it moves; leave load out")
        if self.wall_matrices is not None and self.wall_matrices.count != self.direction_count:
            raise ValueError(f"wall_matrices must be those of {self.direction_count} directions")

    # --- which postures and directions ----------------------------------------------------------------

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Shape of the leading axes of all arrays; () for a single posture with its directions."""
        if self.posture is not None:
            return self.posture.status.shape
        return np.broadcast_shapes(*(design_shape(getattr(self, name)) for name in _OF_DESIGNS))

    @cached_property
    def differing(self) -> tuple[str, ...]:
        """Which of mechanism, given_plant, controller, damping and operator have numbers that differ from point to
        point, as those of several designs do."""
        return differing_fields(self, _OF_DESIGNS)

    @property
    def status(self) -> NDArray[np.uint8]:
        """(...) OK, or why there is no posture (model.posture): OUT_OF_REACH, SINGULAR, BEYOND_LIMIT,
        NO_EQUILIBRIUM."""
        return np.full(self.shape, OK, dtype=np.uint8) if self.posture is None else self.posture.status

    @property
    def direction_count(self) -> int:
        """Number m of directions rendered together."""
        return 1 if self.directions is None else int(self.directions.shape[-2])

    @property
    def direction(self) -> Floats:
        """(..., 3) unit vector, or (..., 6) screw. Raises OperatingPointError where several directions are
        rendered together, and NoMechanismError for a device without a mechanism."""
        if self.directions is None:
            raise NoMechanismError
        if self.direction_count > 1:
            raise OperatingPointError(
                f"{self.direction_count} directions are rendered together here, not a single one; read .directions"
            )
        return np.asarray(self.directions[..., 0, :])

    def __getitem__(self, index: Any) -> Self:
        """One of the points, of shape (), or several, by leading axes; a single device without a mechanism is its
        only one."""
        return self if self.posture is None and not self.shape else self._change_axes(at_index(index))

    @property
    def flat(self) -> Self:
        """All points along one leading axis. Raises NoMechanismError for a device without a mechanism."""
        if not self.differing:
            self._posture  # noqa: B018  raises for a device without a mechanism
        return self._change_axes(in_one_axis(len(self.shape)))

    def _change_axes(self, change: Change) -> Self:
        """The points with `change`, which changes the leading axes of an array, applied to all their arrays."""
        parts = change_fields(self, self.differing, change, self.shape)
        if self.posture is not None and self.directions is not None:
            parts |= {"posture": self.posture.with_axes(change), "directions": change(self.directions)}
        return replace(self, **parts)

    @property
    def turns(self) -> bool:
        """Whether moments about an axis are rendered, and walls are in N m/rad; a screw with a way along it is in
        N/m."""
        return (
            self.directions is not None and self.directions.shape[-1] == 6 and not self.directions[..., :3].any()
        )

    def towards(self, direction: Floats) -> Self:
        """The same postures rendering another direction, unit vectors (..., 3) or screws (..., 6)."""
        given = np.asarray(direction, dtype=np.float64)
        directions = np.broadcast_to(given, (*self.shape, given.shape[-1]))
        return replace(self, directions=directions[..., None, :], wall_matrices=None)

    def along_each(self, directions: Floats) -> Self:
        """The same postures along several directions each: of points (..., 1), points (..., d).

        directions  (d, 3) unit vectors or (d, 6) screws. Raises NoMechanismError for a device without a mechanism.
        """
        spread = replace(self, posture=self._posture.broadcast_to((*self.shape[:-1], len(directions))))
        return spread.towards(directions)

    def in_model(self, model: Model | None) -> Self:
        """The same device, reduced to another model. Under load the posture is the one that the model has there,
        whose drives and links bend, or do not; one that was not sought under the load stays.

        Raises  EquilibriumError, LoadError  where a single posture has no equilibrium in that model
        """
        if model == self.model:
            return self
        other = replace(self, model=model)
        stays = (model == "rigid") == (self.model == "rigid")
        if stays or self.load is None or self._posture.asked is None:
            return other
        assert self.mechanism is not None
        mechanism = self.mechanism.made_rigid if model == "rigid" else self.mechanism
        found = loaded_postures(
            mechanism, self._posture, screw(self.direction), self.load, self.encoders == "motor"
        )
        return replace(other, posture=found)

    @cached_property
    def without_operator(self) -> Self:
        """The plant without an operator."""
        if self.operator is None and self.arm is None:
            return self
        return replace(self, operator=None, operator_name=None, arm=None)

    # --- the mechanism there --------------------------------------------------------------------------

    @property
    def _posture(self) -> Posture:
        """The posture. Raises NoMechanismError for a device without a mechanism."""
        if self.posture is None:
            raise NoMechanismError
        return self.posture

    @property
    def drives(self) -> Drives:
        """The mechanism's drives, a ratio that changes (..., d) at the postures. Raises NoMechanismError."""
        if self.mechanism is None:
            raise NoMechanismError
        return drives_at(self.mechanism.drives, self._posture)

    @property
    def jacobian(self) -> Floats:
        """J (..., 3, c) in the independent coordinates, those of the drives and then of free joints [m/rad]; nan
        where the posture is not OK.

        Raises  NoMechanismError  for a device without a mechanism
        """
        return self._posture.jacobian

    def require(self, *kinds: Literal["dynamics", "sampling"]) -> None:
        """Raise MissingNumbersError where the device file leaves out numbers that these kinds of answers need."""
        keys = [key for kind in kinds for key in self.missing.get(kind, ())]
        if keys:
            raise MissingNumbersError(keys)

    @property
    def mass_matrix(self) -> Floats:
        """M (..., c, c) of the links in the independent coordinates [kg m²]. Raises NoMechanismError as
        `jacobian`, MissingNumbersError where masses are not known."""
        self.require("dynamics")
        return self._posture.mass_matrix

    @cached_property
    def drive_side(self) -> DriveSide:
        """How the drives and the joints' own springs, dampers and friction act on the coordinates. Raises
        NoMechanismError as `jacobian`."""
        posture = self._posture
        assert self.mechanism is not None
        return drive_side(self.mechanism, posture)

    @property
    def whole_mass_matrix(self) -> Floats:
        """M (..., c, c) of links and rotors, all drives rigid, in the independent coordinates [kg m²]. Raises
        NoMechanismError as `jacobian`."""
        return self.drive_side.with_rotors(self.mass_matrix, self.drives)

    @property
    def lever_arms(self) -> Floats:
        """h = J^T u (..., c): handle motion along the direction by each independent coordinate [m/rad].

        Raises  NoMechanismError  for a device without a mechanism
        """
        return lever_arms(self._posture, screw(self.direction))

    @cached_property
    def effective(self) -> EffectiveParameters:
        """Masses [kg] and stiffness [N/m] felt along the direction (...); nan where inapplicable.

        Raises  OperatingPointError  for several directions, and for a measured response
        """
        self.require("dynamics")
        if self.mechanism is not None:
            return effective_parameters(self.mechanism, self._posture, self.direction)
        if self.given_plant is None:
            raise OperatingPointError(NO_MODEL)
        return plant_effective_parameters(self.given_plant)

    @property
    def handle_rows(self) -> Floats:
        """Motion of the handle (3, c) per unit rate of each coordinate of the links, of a single point; with links
        that bend also of the elastic ones."""
        if self.mechanism is None or not self.mechanism.flexible:
            return self.jacobian
        self._check_single("handle_rows")
        return Motions(pack(self.mechanism), self._posture.angles, self.mechanism.flexible).handle.speed

    @property
    def loaded_mechanism(self) -> Mechanism:
        """One design's mechanism as it is linearised under load: the ratios of tables looked up at its posture,
        and all drives and links rigid in the rigid model. Raises NoMechanismError as `jacobian`,
        OperatingPointError."""
        self._check_single("equilibrium")
        posture = self._posture
        assert self.mechanism is not None
        drives = replace(
            drives_at(self.mechanism.drives, posture), ratio_tables=self.mechanism.drives.ratio_tables
        )
        mechanism = replace(self.mechanism, drives=drives)
        return mechanism.made_rigid if self.model == "rigid" else mechanism

    @cached_property
    def equilibrium(self) -> Equilibrium:
        """The haptic equilibrium of a single point under load (thesis eq. 2.4).

        Raises  OperatingPointError  for several points or directions, and without a load
                EquilibriumError, LoadError  where there is none, or no drive or computer holds it
        """
        if self.load is None:
            raise OperatingPointError("no load is given, about which there would be an equilibrium; see device.at")
        mechanism, posture = self.loaded_mechanism, self._posture
        if posture.status != OK:
            raise OperatingPointError(
                "the posture is out of reach, singular or without equilibrium; ask for another"
            )
        axis = screw(self.direction)
        found = solve_equilibrium(mechanism, posture, axis, self.load, self.encoders == "motor")
        if abs(found.wall_force) > self.controller.force_limit:
            unit = unit_of_push(axis)
            raise EquilibriumError(
                f"the load takes {abs(found.wall_force):.6g} {unit} of the wall, more than the force limit of "
                f"{self.controller.force_limit:.6g} {unit}; choose a smaller load"
            )
        return found

    @property
    def handle_range(self) -> tuple[float, float] | None:
        """Range of the handle from its posture along the direction [m]: backwards (not positive), forwards.

        None for a device without a mechanism, and for moments about an axis. Raises OperatingPointError for
        several points.
        """
        if self.mechanism is None or self.direction.shape[-1] == 6:
            return None
        self._check_single("handle_range")
        return handle_range(self.mechanism, self._posture, self.direction)

    def distance_from_path(self, displacement: float) -> float | None:
        """Distance of the handle's path from a displacement along the direction [m].

        The linear plant moves along the tangent, the handle along a curve if it has few drives.

        displacement  from the posture, along the direction [m]
        Returns  None for a device without a mechanism, and for moments about an axis
        Raises   PostureError  (model.posture) where the handle cannot be moved so far
        """
        if self.mechanism is None or self.direction.shape[-1] == 6:
            return None
        self._check_single("distance_from_path")
        if displacement == 0.0:
            return 0.0
        # without forces across, a handle with few drives moves by the part of the direction that it can move along
        motions = handle_motions(self._posture)
        along = motions @ (motions.T @ self.direction)
        goal = self._posture.position + displacement / (along @ self.direction) * along
        reached = solve_posture(self.mechanism, goal, self._posture.assembly, tolerance=PROJECTION_TOLERANCE)
        return float(reached.projected)

    def _check_single(self, what: str) -> None:
        """Raise OperatingPointError for several points. what: the attribute that only a single point has."""
        if self.shape:
            raise OperatingPointError(
                f"{points_text(self.shape)} have no .{what} in common; take one of them, such as "
                f"point[{', '.join('0' for _ in self.shape)}], or call .measure(name), which computes all"
            )


NO_MODEL: Final = "the device has a measured response and no model; call .chart() or .check(...)"


def check_several_directions(
    mechanism: Mechanism | None, operator: Operator | None, encoders: Encoders, load: Load | None
) -> None:
    """Raise SeveralDirectionsError if the device has something that several directions together cannot include."""
    windings = None if mechanism is None else mechanism.drives.winding_damping
    present = {
        "an operator": operator is not None,
        "an encoder on the link": encoders != "motor",
        "a load": load is not None,
        "electrical damping": windings is not None and bool(windings.any()),
    }
    if any(present.values()):
        raise SeveralDirectionsError([name for name, is_present in present.items() if is_present])


def points_text(shape: tuple[int, ...]) -> str:
    """Operating points by their number: 12 operating points of shape (3, 4)."""
    return f"{int(np.prod(shape))} operating points of shape {shape}"


def point_text(point: OperatingPoint) -> str:
    """Device, posture, direction, model, operator, computer and what a load leaves out, as an operating point
    shows itself; of several designs device, shape and operator alone, of several postures their shape in place of
    posture and direction."""
    name = point.name or "a device"
    held = f", held by {point.operator_name or 'an operator'}" if point.operator is not None else ""
    if point.differing:
        return f"OperatingPoint of {name}: designs and postures of shape {point.shape}{held}"
    computer = point.controller.timing_text
    if point.posture is None or point.directions is None:
        kind = "measured response" if point.response is not None else f"plant, model {point.model or 'as given'}"
        return f"OperatingPoint of {name}: {kind}{held}\n  {computer}"
    if point.shape:
        where = f"{int(np.prod(point.shape))} postures of shape {point.shape}"
    else:
        position = ", ".join(f"{x:.6g}" for x in np.round(point.posture.position, 12) + 0.0)
        ways = [", ".join(f"{x:.4g}" for x in np.round(u, 12) + 0.0) for u in point.directions]
        law = f", {point.wall_matrices}" if point.wall_matrices is not None else ""
        where = f"handle at ({position}) m, along " + " and ".join(f"({way})" for way in ways) + law
    model = f"assembly {point.posture.assembly}, model {point.model or 'full'}{held}"
    omitted = "".join(f"\n  {text}" for text in point.load_omissions)
    return f"OperatingPoint of {name}: {where}\n  {model}\n  {computer}{omitted}"
