"""The operating point: a device in one posture or in many, with direction, model, computer and operator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from zwidth import _verbs
from zwidth.arrays import Floats
from zwidth.errors import ModelError, OperatingPointError, ResponseError
from zwidth.loop.controller import Controller
from zwidth.loop.linear_omissions import linear_omissions, load_omissions
from zwidth.loop.loop import Loop, has_inertia_share, with_inertia_of
from zwidth.loop.multi_loop import MultiLoop
from zwidth.loop.posed_device import NO_MODEL, PosedDevice, check_several_directions, point_text
from zwidth.model.arm import attach_arm
from zwidth.model.loaded_posture import LoadedPlants, counting_all, linearise, set_apart
from zwidth.model.multi_plant import MultiPlant, reduce_directions
from zwidth.model.operator import attach
from zwidth.model.plant import Plant
from zwidth.model.reduction import reduce_mechanism, reduce_plant
from zwidth.model.response import Response, handle_obstacle

if TYPE_CHECKING:
    from zwidth.chart.chart_base import Chart
    from zwidth.chart.polar import ByDirection
    from zwidth.chart.verdict import WallVerdicts
    from zwidth.conditions.comparison import BoundsComparison
    from zwidth.contact.contact_simulation import ContactSimulation
    from zwidth.contact.environments.environment import Environment
    from zwidth.contact.hand import Reach, Reflex, Tremor
    from zwidth.contact.mechanism.motion import MechanismMotion
    from zwidth.contact.mechanism.simulate_mechanism import SurfaceRendering
    from zwidth.contact.mechanism.surfaces import Surface
    from zwidth.contact.wall_limit_cycles import LimitCyclePrediction
    from zwidth.guarantees.guarantees import Guarantees
    from zwidth.loop.measured.measured_port import MeasuredPort
    from zwidth.measures.definition import Measure, MeasureValues
    from zwidth.measures.description import Description
    from zwidth.measures.felt import FeltWall
    from zwidth.progress import Progress
    from zwidth.study.boundary.measured_boundary import Experiment, Plan
    from zwidth.study.model_validity import Validity


MOVES: Final = 1e-9  # share of the handle's motions that is none


@dataclass(frozen=True, repr=False)
class OperatingPoint(PosedDevice):
    """Where a device is linearised: a posture or many, direction, model, computer and operator.

    All of it is in `PosedDevice`'s fields.
    """

    def __repr__(self) -> str:
        return point_text(self)

    # --- the next stages ------------------------------------------------------------------------------

    @cached_property
    def plant(self) -> Plant:
        """The rendered direction's dynamics, held by the operator; of one posture and one direction.

        Raises  OperatingPointError  for several points or directions, and for a measured response
                ModelError, DirectionError  (model.reduction) where the model, or the direction, does not apply
        """
        return self.attach_operator(self.ungripped_plant) if self.load is None else self._under_load(held=True)

    @cached_property
    def ungripped_plant(self) -> Plant:
        """The rendered direction's dynamics without the operator. Raises what `plant` raises."""
        if self.response is not None:
            raise OperatingPointError(NO_MODEL)
        if self.given_plant is not None:
            return self.given_plant if self.model is None else reduce_plant(self.given_plant, self.model)
        if self.load is not None:
            return self._under_load(held=False)
        self._check_single("plant")
        self.require("dynamics")
        assert self.mechanism is not None
        return reduce_mechanism(
            self.mechanism, self._posture, self.direction, self.model or "full", self.damping, self.encoders
        )

    def _under_load(self, held: bool) -> Plant:
        """The plant at the haptic equilibrium, with or without the operator; what no wall moves without load
        stands apart, unless it is to count."""
        assert self.load is not None
        plants = self.loaded_plants
        if held and self.arm is not None:
            force, none = self.equilibrium.hand_force, np.zeros(3)
            plants = LoadedPlants(
                self._attach_arm(plants.loaded, force, self.load.weight),
                self._attach_arm(plants.unloaded, none, none),
            )
        elif held:
            plants = LoadedPlants(self.attach_operator(plants.loaded), self.attach_operator(plants.unloaded))
        if self.load.count_sideways:
            return counting_all(plants)
        return set_apart(plants)

    @cached_property
    def loaded_plants(self) -> LoadedPlants:
        """The device at its haptic equilibrium, with and without what the load changes, nobody's arm on it. Raises
        what `equilibrium` raises, and ModelError for a model other than full and rigid."""
        self._check_single("plant")
        self.require("dynamics")
        if self.model not in ("full", "rigid", None):
            raise ModelError(
                f"model {self.model!r} has no form under load, where drives of unlike torques are no one spring; "
                "use 'full' or 'rigid'"
            )
        return linearise(self.loaded_mechanism, self._posture, self.equilibrium, self.damping, self.encoders)

    def attach_operator(self, plant: Plant) -> Plant:
        """A plant of this device with the operator at its handle.

        Returns  the plant itself where there is no operator, or no handle: a model that holds the link side fixed
                 holds the operator, too
        """
        if self.arm is not None:
            return self._attach_arm(plant, np.zeros(3), np.zeros(3) if self.load is None else self.load.weight)
        if self.operator is None or plant.handle is None:
            return plant
        return attach(plant, self.operator, self._motions_across(plant))

    def _attach_arm(self, plant: Plant, force: Floats, gravity: Floats) -> Plant:
        """A full plant with the arm at its handle, which pushes with a force (3,) [N] under gravity (3,) [m/s²].
        Raises ModelError for a reduced model, OperatorError where the arm cannot hold the handle."""
        if self.model not in ("full", None):
            raise ModelError(
                f"an arm that is a chain of bodies holds the full model alone, not {self.model!r}; leave the "
                "model out"
            )
        assert self.arm is not None
        rows = np.zeros((3, plant.size))
        handle = self.handle_rows
        rows[:, : handle.shape[1]] = handle
        return attach_arm(plant, self.arm, rows, self._posture.position, force, gravity)

    def _motions_across(self, plant: Plant) -> Floats:
        """Motions (k, n) of the handle across the rendered direction, of an operator who holds it in every
        direction in which the full model's handle moves; none of any other, in a reduced model, about an axis, and
        with several directions."""
        none = np.zeros((0, plant.size))
        if self.operator is None or self.operator.directions != "all" or self.mechanism is None:
            return none
        if self.model not in ("full", None) or self.turns or self.direction_count > 1:
            return none
        u = self.direction[:3] / np.linalg.norm(self.direction[:3])
        handle = self.handle_rows
        # two directions across u, and how the handle moves along them per rate of each coordinate
        across = np.linalg.svd(np.eye(3) - np.outer(u, u))[2][:2] @ handle
        left, size, _ = np.linalg.svd(across, full_matrices=False)
        kept = size > MOVES * np.linalg.norm(handle)
        rows = np.zeros((int(kept.sum()), plant.size))
        # orthonormal directions in which the handle moves at all
        rows[:, : handle.shape[1]] = left.T[kept] @ across
        return rows

    @cached_property
    def measured_port(self) -> MeasuredPort:
        """A measured device at its encoder and its handle. Raises ResponseError where the handle was not
        measured."""
        from zwidth.loop.measured.measured_port import measured_port

        return measured_port(self.measured, self.controller.sampling_period)

    @property
    def measured(self) -> Response:
        """The measured response, without the operator. Raises OperatingPointError for a device with a model."""
        if self.response is None:
            raise OperatingPointError("the device has a model and no measured response")
        return self.response

    @cached_property
    def modelled(self) -> OperatingPoint:
        """A measured device with a plant fitted to its response in its place, `fit` saying how well; any other
        device itself.

        Raises  ResponseError  where no plant explains the response, or the operator's handle was not measured
        """
        if self.response is None:
            return self
        from zwidth.loop.measured.plant_fit import fit_plant

        if self.operator is not None and (obstacle := handle_obstacle(self.response)):
            raise ResponseError(obstacle)
        T = self.controller.sampling_period
        fit = fit_plant(self.response, T)
        delay = self.controller.delay + fit.delay / T
        return replace(
            self, response=None, given_plant=fit.plant, controller=replace(self.controller, delay=delay), fit=fit
        )

    @cached_property
    def held_response(self) -> Response:
        """The measured response with the operator at the handle. Raises ResponseError as `measured_port`."""
        if self.operator is None:
            return self.measured
        from zwidth.loop.measured.held_response import hold_port

        return hold_port(self.measured, self.measured_port, self.operator)

    @cached_property
    def other_branch(self) -> OperatingPoint | None:
        """The same point on the other branch of the springs that under its load are bent to just where their
        stiffness changes; None where there are none such."""
        if self.load is None or not self.equilibrium.kinked:
            return None
        other: Literal["forward", "backward"] = "forward" if self.load.branch == "backward" else "backward"
        return replace(self, load=replace(self.load, branch=other))

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
        check_several_directions(self.mechanism, self.operator, self.encoders, self.load)
        self.require("dynamics")
        assert self.mechanism is not None
        assert self.directions is not None
        return reduce_directions(self.mechanism, posture, self.directions, self.model or "full", self.damping)

    @cached_property
    def computer(self) -> Controller:
        """The controller at this point: of a feedforward that is given as a share of the device's rigid mass, with
        that mass [kg]; under load with what its constant force leaves of the force limit. Raises
        OperatingPointError where the device has none, or for several points."""
        controller = self.controller
        if self.load is not None and isfinite(controller.force_limit):
            # of which the wall's constant force takes a part
            controller = replace(controller, force_limit=controller.force_limit - abs(self.equilibrium.wall_force))
        if not has_inertia_share(controller):
            return controller
        self._check_single("computer")
        return with_inertia_of(controller, float(self.effective.rigid_mass))

    @cached_property
    def loop(self) -> Loop:
        """The plant under the sampled wall law. Raises what `plant` and `computer` raise."""
        self.require("dynamics", "sampling")
        return Loop(self.plant, self.computer)

    @cached_property
    def contact_loop(self) -> Loop:
        """The loop of a simulated contact: an operator is simulated apart, an arm of bodies is in the plant.
        Raises what `loop` raises."""
        return self.loop if self.operator is None else replace(self, operator=None, operator_name=None).loop

    @cached_property
    def loop_of_directions(self) -> MultiLoop:
        """All directions under one computer. Raises what `plant_of_directions` and `MultiLoop` raise."""
        self.require("dynamics", "sampling")
        return MultiLoop(self.plant_of_directions, self.controller, self.wall_matrices)

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

        plane  of the directions, "xy", "xz" or "yz"; left out: one in which the handle can move in every direction
        count  number of directions, spread evenly over the full turn; from 3 to 3600
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
        spectral_radius: float | None = None,
        stiffness_margin: float | None = None,
        damping_margin: float | None = None,
        delay_margin: float | None = None,
        lowest_frequency: float | None = None,
        highest_frequency: float | None = None,
        force: float | None = None,
        link_radius: float | None = None,
        colliding_links: Sequence[str] | None = None,
    ) -> MeasureValues:
        """A measure of the catalogue by its name, or one of your own, at all points; see `measures.evaluate`.

        stiffness, damping  of the wanted wall, for measures about one [N/m], [N s/m]
        frequency           at which the hand moves [Hz]
        spectral_radius ... colliding_links  what else some measures need, as in `measures.definition.WantedWall`
        """
        wanted = {name: value for name, value in locals().items() if name not in ("self", "measure")}
        return _verbs.measure(self, measure, wanted).about(self)

    def bounds(self, damping: float | None = None) -> BoundsComparison:
        """Every published condition beside the exact limit; see `conditions.comparison.compare_bounds`.

        damping  at which the conditions are compared [N s/m]; left out: that of the stiffest stable wall
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
        """Simulate how a stability boundary is measured on a device; see `study.boundary`."""
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
    def load_omissions(self) -> tuple[str, ...]:
        """What every answer under this load leaves out, in words; () without a load, or links that bend."""
        return load_omissions(self.mechanism, self.load, self.model)

    @property
    def charted_by_response(self) -> bool:
        """Whether the chart is that of a frequency response: a measured one, or that of a loss factor."""
        hysteretic = self.given_plant is not None and self.given_plant.hysteresis is not None
        return self.response is not None or hysteretic
