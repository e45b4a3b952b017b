"""All guarantees of one loop, or of a device at one operating point, side by side, the strongest first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.errors import ChartError
from zwidth.guarantees.coupling import couplings, no_couplings
from zwidth.guarantees.guarantees import COLGATE, EXACT, NO_STABLE, Guarantee, Guarantees
from zwidth.guarantees.passive import passive_region
from zwidth.guarantees.port import without_idle_motions
from zwidth.guarantees.region import Region, empty_region, stiffest_corner
from zwidth.guarantees.spring_stable import nyquist_region, spring_stable_region
from zwidth.guarantees.stable_alone import AS_BENT, Premise, bent_as_loaded, stable_alone
from zwidth.loop.controller import acts, feedback_name
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind, check_number, wrong_type
from zwidth.progress import Progress

SPRINGS = "spring stability after Colgate and Schenkel 1997, known at second hand (thesis 1.1.3)"
NO_HANDLE = "the plant has no handle at which an operator could hold it; give plant.handle"


def find_guarantees(
    loop: Loop, robust: Sequence[Floats] | None = None, progress: Progress | None = None
) -> Guarantees:
    """Every guarantee of a loop.

    loop    the device without operator; an operator attached to the plant counts as a part of the device
    robust  rings (k, 2) of [K, B] of a robust chart, stable for a range of operators; listed before `stable`
    progress  as in `spring_stable_region`, which takes most of the time

    Names: `passive-at-actuator` (where the handle is elsewhere), `passive`, `spring-stable`, `nyquist-spring`,
    `robust` (if given), `stable`. Without a handle only the first and the last are known. Of a device that is
    unstable by itself (`stable_alone`) all but the last two are withheld.

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> paddle = Plant(np.array([[0.03]]), np.array([[1.0]]), np.zeros((1, 1)), one, one, one)
    >>> result = find_guarantees(Loop(paddle, Controller(sampling_period=0.001)))
    >>> [guarantee.name for guarantee in result.guarantees]
    ['passive', 'spring-stable', 'nyquist-spring', 'stable']
    """
    check_kind("loop", loop, Loop)
    return _guarantees(loop, (stable_alone(loop),), robust, progress)


def _guarantees(
    loop: Loop,
    premises: tuple[Premise, ...],
    robust: Sequence[Floats] | None = None,
    progress: Progress | None = None,
) -> Guarantees:
    """Every guarantee of a loop as far as its premises allow; the first that fails is why others are withheld: all
    but `robust`, and `stable`, which is withheld only where links bend under load. Premises that are not known
    become warnings.

    robust    rings [K, B] of a robust chart's stable set; None: there is no such guarantee
    progress  as in `spring_stable_region`
    """
    moving = _without_idle_motions(loop)
    guarantees = list[Guarantee]()
    failing = next((each for each in premises if each.fails), None)
    unknown = "; ".join(each.reason for each in premises if each.holds is None)

    def as_known(find: Callable[[], Region]) -> Region:
        return empty_region(failing.reason) if failing is not None else find().with_warning(unknown)

    guarantees += _passive_guarantees(moving, as_known)
    guarantees += _spring_guarantees(moving, as_known, progress)
    if robust is not None:
        guarantees.append(
            Guarantee("robust", "stable for a whole range of operators", region_of(robust), "robust chart")
        )
    chart = stability_chart(loop, decay=False).drawn()
    of_chart = next((each for each in premises if each.fails and each.what == AS_BENT), None)
    stable = _stable_region(chart) if of_chart is None else empty_region(of_chart.reason)
    guarantees.append(Guarantee("stable", "stable with the device as described", stable, EXACT))
    return Guarantees(loop, tuple(guarantees), chart, premises=premises)


def _passive_guarantees(moving: Loop, as_known: Callable[[Callable[[], Region]], Region]) -> list[Guarantee]:
    """Find the walls [N/m, N s/m] for passive operators: at the actuator where it is not the handle, and at the
    handle.

    moving    the loop without idle motions
    as_known  gives the region that a function finds, or an empty one where a premise fails
    """
    plant = moving.plant
    guarantees = []
    apart = plant.handle is None or not _same_place(plant.actuator, plant.handle)
    if apart:
        guarantees.append(
            Guarantee(
                "passive-at-actuator",
                "stable whatever passive linear operator holds the actuator",
                as_known(lambda: passive_region(moving, plant.actuator)),
                COLGATE,
            )
        )
    has_handle = plant.handle is not None
    guarantees.append(
        Guarantee(
            "passive",
            "stable whatever passive linear operator holds the handle",
            as_known(lambda: passive_region(moving) if has_handle else empty_region(NO_HANDLE)),
            COLGATE,
        )
    )
    return guarantees


def _spring_guarantees(
    moving: Loop, as_known: Callable[[Callable[[], Region]], Region], progress: Progress | None
) -> list[Guarantee]:
    """Find the walls [N/m, N s/m] for springs at the handle: for any of them, and for the one of the Nyquist
    frequency.

    moving, as_known  as in `_passive_guarantees`;   progress  as in `spring_stable_region`
    """
    return [
        Guarantee(
            "spring-stable",
            "stable whatever spring holds the handle, from none to one that holds it fixed",
            as_known(lambda: _spring_region(partial(spring_stable_region, progress=progress), moving)),
            SPRINGS,
        ),
        Guarantee(
            "nyquist-spring",
            "stable with the one spring that puts a mode at the Nyquist frequency",
            as_known(lambda: _spring_region(nyquist_region, moving)),
            SPRINGS,
        ),
    ]


def _stable_region(chart: StabilityChart) -> Region:
    """The chart's walls, stable with the device as described, as a region."""
    peak = chart.stiffness_max
    return Region(chart.regions, peak, chart.damping_at_stiffness_max, None if np.isfinite(peak) else NO_STABLE)


def guarantees_of(
    point: OperatingPoint,
    coupling: bool = False,
    wall: tuple[float, float] | None = None,
    progress: Progress | None = None,
) -> Guarantees:
    """Every guarantee of a device at one operating point, without its operator, who is one of the passive ones.

    coupling  also virtual couplings after Llewellyn and Raisbeck, and of the sampled device, as `couplings`
    wall      K [N/m] > 0 and B [N s/m] of a wall: also the stiffest coupling through which it may be rendered
    progress  as in `spring_stable_region`, which takes most of the time
    Raises    ValueError  for a wall whose numbers are not valid
              what `OperatingPoint.loop` raises, and ChartError where the chart of the bare device is undecided
    """
    check_kind("point", point, OperatingPoint)
    if wall is not None:
        _check_wall(wall)
    if point.response is not None:
        from zwidth.guarantees.measured import measured_guarantees

        found = measured_guarantees(point)
        if not coupling and wall is None:
            return found
        return replace(
            found, couplings=no_couplings("no coupling is known of a measured response; give a [plant]")
        )
    loop = point.without_operator.loop
    premises = (*(bent_as_loaded(text) for text in point.load_omissions), stable_alone(loop))
    guarantees = _guarantees(loop, premises, progress=progress)
    if not coupling and wall is None:
        return guarantees
    if guarantees.refusal is not None:
        return replace(guarantees, couplings=no_couplings(guarantees.refusal))
    if loop.has_fixed_feedback:
        names = [*loop.controller.feedback_names, *(["a load"] if loop.plant.is_loaded else [])]
        reason = f"no coupling is known with {', '.join(names)}"
        return replace(guarantees, couplings=no_couplings(reason))
    moving = _without_idle_motions(loop)
    handle = moving.plant.handle
    return replace(guarantees, couplings=no_couplings() if handle is None else couplings(moving, handle, wall))


def _without_idle_motions(loop: Loop) -> Loop:
    """The loop without the motions that change none of its guarantees."""
    return Loop(without_idle_motions(loop.plant), loop.controller)


def _check_wall(wall: object) -> None:
    """Raise an error unless the wall is a pair of stiffness [N/m], above 0, and damping [N s/m]."""
    if not isinstance(wall, tuple | list) or len(wall) != 2:
        raise wrong_type("wall", "a pair of stiffness [N/m] and damping [N s/m]", wall)
    check_number("the wall's stiffness", wall[0], "N/m", above=0.0)
    check_number("the wall's damping", wall[1], "N s/m")


def _spring_region(find_region: Callable[[Loop], Region], loop: Loop) -> Region:
    """The region that `find_region` makes of charts with springs at the handle; empty, with the reason, where
    there is no handle, a force sensor reads these springs, or a chart cannot be closed."""
    if loop.plant.handle is None:
        return empty_region(NO_HANDLE)
    sensor = loop.controller.force_sensor
    if sensor is not None and acts(sensor):
        return empty_region(f"this is not known with {feedback_name(sensor)}")
    try:
        return find_region(loop)
    except ChartError as error:
        return empty_region(f"this is undecided: {error}")


def region_of(rings: Sequence[Floats]) -> Region:
    """The region of rings of walls [K, B] from a robust chart."""
    K, B = stiffest_corner(rings)
    return Region(tuple(rings), K, B, None if K > 0.0 else NO_STABLE)


def _same_place(first: Floats, second: Floats) -> bool:
    """Whether two coordinates are the same motion up to a factor."""
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return abs(abs(float(first @ second)) - size) <= 1e-12 * size
