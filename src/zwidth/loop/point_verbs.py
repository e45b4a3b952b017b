"""What can be asked at an operating point, as its methods: each forwards to the function that answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast

from numpy.typing import ArrayLike

from zwidth import _verbs

if TYPE_CHECKING:
    from zwidth.chart.polar import ByDirection
    from zwidth.chart.result import Chart
    from zwidth.chart.verdict import WallVerdicts
    from zwidth.conditions.comparison import BoundsComparison
    from zwidth.contact.contact_simulation import ContactSimulation
    from zwidth.contact.environments.environment import Environment
    from zwidth.contact.hand import Reach, Reflex, Tremor
    from zwidth.contact.limit_cycle_prediction import LimitCyclePrediction
    from zwidth.contact.mechanism.motion import MechanismMotion
    from zwidth.contact.mechanism.surfaces import Surface
    from zwidth.contact.mechanism.walls import Wall
    from zwidth.guarantees.nested import Guarantees
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.measures.description import Description
    from zwidth.measures.felt_wall import FeltWall
    from zwidth.measures.measure import Measure, Measured
    from zwidth.study.experiment_plan import Plan
    from zwidth.study.measured_boundary import Experiment
    from zwidth.study.validity import Validity

Progress = Callable[[str, int, int], None]


class PointVerbs:
    """The verbs of an `OperatingPoint`."""

    @property
    def _point(self) -> OperatingPoint:
        return cast("OperatingPoint", self)

    def chart(self, radius: float = 1.0, *, decay: bool = True) -> Chart:
        """The stable walls at a single point, exactly; see `chart.at_point.chart_at`.

        radius  less than 1 for the walls whose slowest motion shrinks at least by that factor per sample
        decay   False skips the search for the fastest-decaying walls, most of the time
        """
        return _verbs.chart(self._point, radius, decay)

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> WallVerdicts:
        """Verdicts on walls K [N/m], B [N s/m] of any shape (...) that broadcast; see `chart.at_point`."""
        return _verbs.check(self._point, wall_stiffness, wall_damping)

    def by_direction(self, plane: str | None = None, count: int = 72) -> ByDirection:
        """The largest stiffness along directions round a plane; see `chart.polar.largest_stiffness_around`.

        plane  "xy", "xz" or "yz"; left out: one that the handle can move all over
        """
        return _verbs.by_direction(self._point, plane, count)

    def describe(self) -> Description:
        """Masses, stiffness, frequencies and dexterity of the device by itself at a single point."""
        return _verbs.describe(self._point)

    def measure(
        self,
        measure: str | Measure,
        *,
        stiffness: float | None = None,
        damping: float | None = None,
        frequency: float | None = None,
    ) -> Measured:
        """A measure of the catalogue by its name, or one of your own, at all points; see `measures.evaluate`.

        stiffness, damping  of the wanted wall, for measures about one [N/m], [N s/m]
        frequency           at which the hand moves [Hz]
        """
        return _verbs.measure(self._point, measure, stiffness, damping, frequency)

    def bounds(self, damping: float | None = None) -> BoundsComparison:
        """Every published condition beside the exact limit; see `conditions.comparison.compare_bounds`.

        damping  of the walls compared [N s/m]; left out: that of the stiffest stable wall
        """
        return _verbs.bounds(self._point, damping)

    def guarantees(self, *, coupling: bool = False, wall: tuple[float, float] | None = None) -> Guarantees:
        """The walls that are stable with every passive operator, every spring, and as they are; see
        `guarantees.nested.guarantees_of`.

        coupling  also virtual couplings;   wall  K, B that one of them is to render [N/m], [N s/m]
        """
        return _verbs.guarantees(self._point, coupling, wall)

    def felt(self, stiffness: float, damping: float) -> FeltWall:
        """What the hand feels of a wall [N/m], [N s/m]; see `measures.felt_wall`."""
        return _verbs.felt(self._point, stiffness, damping)

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
    ) -> ContactSimulation:
        """What happens on contact with a wall, or something else; see `contact.simulate_contact`, which has all
        arguments, for their meaning."""
        return _verbs.simulate(
            self._point,
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
        )

    def move(
        self,
        wall: Wall | None = None,
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
    ) -> MechanismMotion:
        """The large motion of the whole mechanism from here, at a surface or free; see
        `contact.simulate_mechanism`, which says what each argument means."""
        return _verbs.move(
            self._point,
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
        """Vibrations that keep themselves up on a wall, and what simulations find of them; see
        `contact.predict_limit_cycles`."""
        return _verbs.limit_cycles(self._point, stiffness, damping, offset, simulate, progress)

    def measure_boundary(
        self,
        plan: Plan | None = None,
        own_points: Sequence[object] = (),
        *,
        file: str | Path | None = None,
        progress: Progress | None = None,
    ) -> Experiment:
        """A stability boundary as it is measured on a device; see `study.experiment.measure_boundary`."""
        return _verbs.measure_boundary(self._point, plan, own_points, file, progress)

    def validity(self, tolerance: float = 0.1) -> Validity:
        """How far along the edge of the full model a simpler one tells the same; see `study.validity`."""
        return _verbs.validity(self._point, tolerance)
