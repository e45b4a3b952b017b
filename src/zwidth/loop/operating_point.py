"""The operating point: a device in one posture or in many, with direction, model, computer and operator."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth import _verbs
from zwidth.loop.controller import Controller
from zwidth.loop.inertia_share import has_inertia_share, with_inertia_of
from zwidth.loop.linear_omissions import linear_omissions
from zwidth.loop.loop import Loop
from zwidth.loop.multi_loop import MultiLoop
from zwidth.loop.point_errors import (
    MissingNumbersError,
    NoMechanismError,
    OperatingPointError,
    check_several_directions,
)
from zwidth.loop.point_text import point_text, points_text
from zwidth.loop.wall_matrices import WallMatrices
from zwidth.model.argument_checks import check_choice
from zwidth.model.damping import Damping, GivenDamping
from zwidth.model.design_axes import change_designs, design_shape
from zwidth.model.drive_side import DriveSide, drive_side
from zwidth.model.effective_parameters import EffectiveParameters, effective_parameters, lever_arms, screw
from zwidth.model.mechanism import Drives, Floats, Mechanism
from zwidth.model.multi_plant import MultiPlant, reduce_directions
from zwidth.model.operator import Operator, attach
from zwidth.model.plant import Plant
from zwidth.model.posture import OK, Posture, handle_motions, handle_range, solve_posture
from zwidth.model.ratio_table import drives_at
from zwidth.model.reduction import Encoders, Model, plant_effective_parameters, reduce_mechanism, reduce_plant
from zwidth.model.response import Response

if TYPE_CHECKING:
    from zwidth.chart.chart_base import Chart
    from zwidth.chart.polar import ByDirection
    from zwidth.chart.verdict import WallVerdicts
    from zwidth.conditions.comparison import BoundsComparison
    from zwidth.contact.contact_simulation import ContactSimulation
    from zwidth.contact.environments.environment import Environment
    from zwidth.contact.hand import Reach, Reflex, Tremor
    from zwidth.contact.limit_cycle_prediction import LimitCyclePrediction
    from zwidth.contact.mechanism.motion import MechanismMotion
    from zwidth.contact.mechanism.surfaces import Surface
    from zwidth.contact.mechanism.walls import SurfaceRendering
    from zwidth.guarantees.loop_guarantees import Guarantees
    from zwidth.measures.definition import Measure, MeasureValues
    from zwidth.measures.description import Description
    from zwidth.measures.felt_wall import FeltWall
    from zwidth.progress import Progress
    from zwidth.study.experiment_plan import Plan
    from zwidth.study.measured_boundary import Experiment
    from zwidth.study.validity import Validity

# Where the handle is: x, y or x, y, z [m], or the angle of every driven joint by the name of its link [rad].
Position: TypeAlias = Sequence[float] | Mapping[str, float]

_OF_DESIGNS: Final = ("mechanism", "given_plant", "controller", "damping", "operator")

# Share of the arm's length within which a single position is projected onto the nearest that the handle has.
PROJECTION_TOLERANCE: Final = 0.01


@dataclass(frozen=True, repr=False)
class OperatingPoint:
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
    operator_name       the operator's name in results; None: nobody
    friction_known, resolution_known   whether the dry friction, and the encoders' step, are given, 0 included
    name                the device's name in results and figures
    requested_position  position as requested, before it was projected; None: the device's reference
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
    friction_known: bool = True
    resolution_known: bool = True
    name: str = ""
    requested_position: Position | Floats | None = None
    missing: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    results: dict[Any, Any] = field(init=False, default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        """Raise ValueError for arguments that exclude each other."""
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
        if self.wall_matrices is not None and self.wall_matrices.count != self.direction_count:
            raise ValueError(f"wall_matrices must be those of {self.direction_count} directions")

    def __repr__(self) -> str:
        return point_text(self)

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
        return tuple(name for name in _OF_DESIGNS if design_shape(getattr(self, name)))

    @property
    def status(self) -> NDArray[np.uint8]:
        """(...) OK, OUT_OF_REACH or SINGULAR (model.posture)."""
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

    def __getitem__(self, index: Any) -> OperatingPoint:
        """One of the points, of shape (), or several, by leading axes; a single device without a mechanism is its
        only one."""
        return self if self.posture is None and not self.shape else self._change_axes(lambda array: array[index])

    @property
    def flat(self) -> OperatingPoint:
        """All points along one leading axis. Raises NoMechanismError for a device without a mechanism."""
        if not self.differing:
            self._posture  # noqa: B018  raises for a device without a mechanism
        axes = len(self.shape)
        return self._change_axes(lambda array: array.reshape(-1, *array.shape[axes:]))

    def _change_axes(self, change: Callable[[NDArray[Any]], NDArray[Any]]) -> OperatingPoint:
        """The points with `change`, which changes the leading axes of an array, applied to all their arrays."""
        parts: dict[str, Any] = {
            name: change_designs(getattr(self, name), change, self.shape) for name in self.differing
        }
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

    def towards(self, direction: Floats) -> OperatingPoint:
        """The same postures rendering another direction, unit vectors (..., 3) or screws (..., 6)."""
        given = np.asarray(direction, dtype=np.float64)
        directions = np.broadcast_to(given, (*self.shape, given.shape[-1]))
        return replace(self, directions=directions[..., None, :], wall_matrices=None)

    def in_model(self, model: Model | None) -> OperatingPoint:
        """The same device, reduced to another model."""
        return self if model == self.model else replace(self, model=model)

    @cached_property
    def without_operator(self) -> OperatingPoint:
        """The plant without an operator."""
        return self if self.operator is None else replace(self, operator=None, operator_name=None)

    # --- the mechanism there --------------------------------------------------------------------------

    @property
    def _posture(self) -> Posture:
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
        """M (..., c, c) of the links in the independent coordinates [kg m^2]. Raises NoMechanismError as
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
        """M (..., c, c) of links and rotors, all drives rigid, in the independent coordinates [kg m^2]. Raises
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
            raise OperatingPointError(_NO_MODEL)
        return plant_effective_parameters(self.given_plant)

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

    # --- the next stages ------------------------------------------------------------------------------

    @cached_property
    def plant(self) -> Plant:
        """The rendered direction's dynamics, held by the operator; of one posture and one direction.

        Raises  OperatingPointError  for several points or directions, and for a measured response
                ModelError, DirectionError  (model.reduction) where the model, or the direction, does not apply
        """
        return self.attach_operator(self.ungripped_plant)

    @cached_property
    def ungripped_plant(self) -> Plant:
        """The rendered direction's dynamics without the operator. Raises what `plant` raises."""
        if self.response is not None:
            raise OperatingPointError(_NO_MODEL)
        if self.given_plant is not None:
            return self.given_plant if self.model is None else reduce_plant(self.given_plant, self.model)
        self._check_single("plant")
        self.require("dynamics")
        assert self.mechanism is not None
        return reduce_mechanism(
            self.mechanism, self._posture, self.direction, self.model or "full", self.damping, self.encoders
        )

    def attach_operator(self, plant: Plant) -> Plant:
        """A plant of this device with the operator at its handle.

        Returns  the plant itself where there is no operator, or no handle: a model that holds the link side fixed
                 holds the operator, too
        """
        return plant if self.operator is None or plant.handle is None else attach(plant, self.operator)

    @cached_property
    def plant_of_directions(self) -> MultiPlant:
        """The dynamics of all directions that are rendered together, m of them, in one posture.

        Raises  SeveralDirectionsError  for what such plants leave out: an operator, encoders on the links,
                                        electrical damping
                OperatingPointError     for several postures
                NoMechanismError        for a device without a mechanism
                ModelError, DirectionError  (model.reduction) as `plant`
        """
        posture = self._posture
        self._check_single("plant")
        check_several_directions(self.mechanism, self.operator, self.encoders)
        self.require("dynamics")
        assert self.mechanism is not None
        assert self.directions is not None
        return reduce_directions(self.mechanism, posture, self.directions, self.model or "full", self.damping)

    @cached_property
    def computer(self) -> Controller:
        """The controller at this point: of a feedforward that is given as a share of the device's rigid mass, with
        that mass [kg]. Raises OperatingPointError where the device has none, or for several points."""
        if not has_inertia_share(self.controller):
            return self.controller
        self._check_single("computer")
        return with_inertia_of(self.controller, float(self.effective.rigid_mass))

    @cached_property
    def loop(self) -> Loop:
        """The plant under the sampled wall law. Raises what `plant` and `computer` raise."""
        self.require("dynamics", "sampling")
        return Loop(self.plant, self.computer)

    @cached_property
    def loop_of_directions(self) -> MultiLoop:
        """All directions under one computer. Raises what `plant_of_directions` and `MultiLoop` raise."""
        self.require("dynamics", "sampling")
        return MultiLoop(self.plant_of_directions, self.controller, self.wall_matrices)

    def _check_single(self, what: str) -> None:
        """Raise OperatingPointError for several points. what: the attribute that only a single point has."""
        if self.shape:
            raise OperatingPointError(
                f"{points_text(self.shape)} have no .{what} in common; take one of them, such as "
                f"point[{', '.join('0' for _ in self.shape)}], or call .measure(name), which computes all"
            )

    # --- verbs: each forwards to the function that computes the result ---------------------------------

    def chart(self, radius: float = 1.0, *, decay: bool = True) -> Chart:
        """The stable walls at a single point, exactly; see `chart.point_chart.chart_at`.

        radius  less than 1 for the walls whose slowest motion shrinks at least by that factor per sample
        decay   False skips the search for the fastest-decaying walls, which takes most of the time
        """
        return _verbs.chart(self, radius, decay).about(self)

    def check(
        self, wall_stiffness: ArrayLike, wall_damping: ArrayLike, *, progress: Progress | None = None
    ) -> WallVerdicts:
        """Verdicts on walls K [N/m], B [N s/m] of any shape (...) that broadcast; see `chart.point_chart`."""
        return _verbs.check(self, wall_stiffness, wall_damping, progress).about(self)

    def by_direction(
        self, plane: str | None = None, count: int = 72, *, progress: Progress | None = None
    ) -> ByDirection:
        """The largest stiffness along directions round a plane; see `chart.polar.largest_stiffness_around`.

        plane  "xy", "xz" or "yz"; left out: one in which the handle can move in every direction
        count  number of directions, at least 3
        """
        return _verbs.by_direction(self, plane, count, progress).about(self)

    def describe(self) -> Description:
        """Masses, stiffness, frequencies and dexterity of the device without operator at a single point."""
        return _verbs.describe(self).about(self)

    def measure(
        self,
        measure: str | Measure,
        *,
        stiffness: float | None = None,
        damping: float | None = None,
        frequency: float | None = None,
    ) -> MeasureValues:
        """A measure of the catalogue by its name, or one of your own, at all points; see `measures.evaluate`.

        stiffness, damping  of the wanted wall, for measures about one [N/m], [N s/m]
        frequency           at which the hand moves [Hz]
        """
        return _verbs.measure(self, measure, stiffness, damping, frequency).about(self)

    def bounds(self, damping: float | None = None) -> BoundsComparison:
        """Every published condition beside the exact limit; see `conditions.comparison.compare_bounds`.

        damping  of the walls compared [N s/m]; left out: that of the stiffest stable wall
        """
        return _verbs.bounds(self, damping).about(self)

    def guarantees(
        self,
        *,
        coupling: bool = False,
        wall: tuple[float, float] | None = None,
        progress: Progress | None = None,
    ) -> Guarantees:
        """The walls that are stable with every passive operator, with every spring, and without an operator; see
        `guarantees.loop_guarantees.guarantees_of`.

        coupling  whether to compute virtual couplings too
        wall      K, B of a wall that a virtual coupling is to render [N/m], [N s/m]
        """
        return _verbs.guarantees(self, coupling, wall, progress).about(self.without_operator)

    def felt(self, stiffness: float, damping: float) -> FeltWall:
        """Felt impedance and stiffness of a wall [N/m], [N s/m]; see `measures.felt_wall`."""
        return _verbs.felt(self, stiffness, damping).about(self)

    def simulate(
        self,
        stiffness: float | None = None,
        damping: float | None = None,
        *,
        wall: Literal["two-sided", "one-sided"] = "two-sided",
        no_pull: bool = False,
        environment: str | Environment | None = None,
        parameters: Mapping[str, float] | None = None,
        wall_position: float = 0.0,
        start_position: float | None = None,
        start_velocity: float = 0.0,
        push: float | None = None,
        ramp: float = 0.0,
        tremor: Tremor | None = None,
        reach: Reach | None = None,
        reflex: Reflex | None = None,
        passivity_damping: float | None = None,
        duration: float | None = None,
        substeps: int = 20,
        seed: int = 0,
        progress: Progress | None = None,
    ) -> ContactSimulation:
        """Simulate contact with a wall, or another environment; see `contact.simulate_contact`, which has all
        arguments, for their meaning."""
        return _verbs.simulate(
            self,
            stiffness,
            damping,
            wall=wall,
            no_pull=no_pull,
            environment=environment,
            parameters=parameters,
            wall_position=wall_position,
            start_position=start_position,
            start_velocity=start_velocity,
            push=push,
            ramp=ramp,
            tremor=tremor,
            reach=reach,
            reflex=reflex,
            passivity_damping=passivity_damping,
            duration=duration,
            substeps=substeps,
            seed=seed,
            progress=progress,
        )

    def move(
        self,
        wall: SurfaceRendering | None = None,
        surface: Surface | None = None,
        *,
        duration: float = 1.0,
        start_velocity: ArrayLike | None = None,
        push: ArrayLike | None = None,
        gravity: ArrayLike | None = None,
        substeps: int = 4,
        counted: bool = True,
        torque_limits: Literal["each", "together"] = "each",
        seed: int = 0,
        progress: Progress | None = None,
    ) -> MechanismMotion:
        """The large motion of the whole mechanism from here, at a surface or free; see
        `contact.simulate_mechanism`, which says what each argument means."""
        return _verbs.move(
            self,
            wall,
            surface,
            duration=duration,
            start_velocity=start_velocity,
            push=push,
            gravity=gravity,
            substeps=substeps,
            counted=counted,
            torque_limits=torque_limits,
            seed=seed,
            progress=progress,
        )

    def limit_cycles(
        self,
        stiffness: float,
        damping: float,
        *,
        offset: float = 0.0,
        simulate: bool = True,
        progress: Progress | None = None,
    ) -> LimitCyclePrediction:
        """Limit cycles on a wall [N/m], [N s/m], predicted and simulated; see `contact.predict_limit_cycles`."""
        return _verbs.limit_cycles(self, stiffness, damping, offset, simulate, progress).about(self)

    def measure_boundary(
        self,
        plan: Plan | None = None,
        user_points: Sequence[object] = (),
        *,
        file: str | Path | None = None,
        progress: Progress | None = None,
    ) -> Experiment:
        """Simulate how a stability boundary is measured on a device; see `study.experiment.measure_boundary`."""
        return _verbs.measure_boundary(self, plan, user_points, file, progress).about(self)

    def validity(self, tolerance: float = 0.1) -> Validity:
        """Find where along the edge of the full model the simpler ones agree with it; see `study.validity`."""
        return _verbs.validity(self, tolerance).about(self)

    # --- properties that results report ---------------------------------------------------------------

    @property
    def linear_omissions(self) -> tuple[str, ...]:
        """Parts of the device that a linear answer leaves out, in words; () if there are none."""
        return linear_omissions(self.mechanism, self.given_plant, self.controller)

    @property
    def charted_by_response(self) -> bool:
        """Whether the chart is that of a frequency response: a measured one, or that of a loss factor."""
        hysteretic = self.given_plant is not None and self.given_plant.hysteresis is not None
        return self.response is not None or hysteretic


_NO_MODEL: Final = "the device has a measured response and no model; call .chart() or .check(...)"
