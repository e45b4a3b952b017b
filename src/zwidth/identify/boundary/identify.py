"""Numbers of a device from a measured stability boundary: damping, delay, operator, whichever are named.

The points are compared with the exact chart (`model`); where dry friction makes the boundary hang on the
amplitude, with trials on the simulated device (`trials`). The scatter is estimated from what remains.

`compare_models` says which of several models of damping explains a measured boundary best, and whether the points
can tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.edge_crossings import EdgeChords
from zwidth.device.device import Device
from zwidth.device.faults import comma_list, fail, plural
from zwidth.errors import DeviceError
from zwidth.identify.boundary.checks import (
    MOST_NAMED,
    check_circumstances,
    check_explained,
    check_file_period,
    check_magnitudes,
    check_points,
    complete_points,
    share_of_points,
)
from zwidth.identify.boundary.damping_models import HYSTERETIC, MODAL, models_of
from zwidth.identify.boundary.fit import (
    BoundaryFit,
    derivatives,
    first_scatter,
    fit_boundary,
    kept_points,
    log_likelihood,
)
from zwidth.identify.boundary.model import BoundaryModel
from zwidth.identify.boundary.parameters import BoundaryParameters
from zwidth.identify.boundary.points import COLUMNS, BoundaryPoints, read_boundary_points
from zwidth.identify.boundary.trials import TrialModel, TrialPlan, model_by_trials, needs_trials
from zwidth.identify.identification import Check, Estimate, Identification, refused
from zwidth.identify.records.record import Record
from zwidth.loop.operating_point import OperatingPoint
from zwidth.progress import Progress

__all__ = ["COLUMNS", "identify_boundary"]


KIND: Final = "boundary"
ROUTES: Final = (None, "chart", "experiment")
ALIKE: Final = 0.95  # correlation of two numbers, from which on a reader must know of it
NOTHING: Final = 1e-9  # change of the points, in units of the scatter, that a number without effect makes
OUTLIER: Final = 4.0  # standard deviations
ROUNDING: Final = 1e-6  # standard deviations, below which nothing is an outlier
FEWEST_VALIDATED: Final = 6  # points on the boundary
MOST_LOST_NAMED: Final = 12  # points without an edge in trials


def identify_boundary(
    device: Device,
    records: Sequence[Record],
    *,
    point: OperatingPoint | None = None,
    paths: Sequence[str] = (),
    damping_models: str | Sequence[str] = (),
    through: str | None = None,
    disturbance: float | None = None,
    visible: float | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Fit numbers of a device to a stability boundary that was measured on it.

    records         with the columns of `COLUMNS`; what `zwidth experiment --output FILE.csv` writes is one
    point           posture, direction and who holds the device; None: `device.at()`
    paths           of the numbers to fit, as `--set` takes them
    damping_models  names of `damping_models.NUMBERS`, or "all": each is fitted, with the numbers of `paths`, in
                    place of the device's own damping, and they are compared; the estimates are those of the best
    through         "chart", "experiment": what the points are compared with; None: the chart, and trials on the
                    simulated device where it has dry friction or an estimate of velocity that is not linear
    disturbance     initial disturbance of those trials [m]; None: each point's own perturbation_N over its
                    stiffness, or 1 mm
    visible         amplitude up to which those trials count as still [m]; None: each point's own
                    amplitude_m, or three encoder steps
    progress        called with stage, steps done, and steps
    Raises          DeviceError  for faults of the records and of the arguments, and where the device has no chart
    """
    device, point = _held_device(device, records, point, paths, damping_models, through)
    report = progress or (lambda stage, done, of: None)
    report("reading the points", 0, 0)
    points, checks = complete_points(read_boundary_points(records), records)
    models = models_of(damping_models, device, point) if damping_models else []
    choices = [BoundaryParameters.of(device, point, paths, model) for model in models]
    choices = choices or [BoundaryParameters.of(device, point, paths)]
    count = max(len(one.start) for one in choices)
    checks += check_points(points, count)
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    simulated = needs_trials(point, through)
    checks += [check_magnitudes(points, _own_edge(choices[0], point)), *check_circumstances(points, simulated)]
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    plan = TrialPlan.of(points, point, disturbance, visible) if simulated else None
    checks.append(_check_route(point, plan))
    fits = [(_points_beside_edges(points, one, plan, report), one) for one in choices]
    checks += [*_lost_point_checks(fits, records), _check_moves_boundary(fits[0][0], fits[0][1])]
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    comparison = compare_models(fits, report)
    return _validated(device, records, checks, comparison, plan, report)


def _held_device(
    device: Device,
    records: Sequence[Record],
    point: OperatingPoint | None,
    paths: Sequence[str],
    damping_models: str | Sequence[str],
    through: str | None,
) -> tuple[Device, OperatingPoint]:
    """Check the arguments of `identify_boundary`; return the device as it is held, and where it is used.

    point   None: the device's reference
    Raises  DeviceError  without records or numbers to fit, and for another word in `through`
    """
    if not records:
        raise fail(device.label, "", "no record was given; give a CSV file with points of the boundary")
    if through not in ROUTES:
        raise fail(device.label, "through", f"must be chart, experiment or nothing, got {through!r}")
    point = device.at() if point is None else point
    if point.operator != device.operator:
        device = device.held_by(point.operator or "none")
    if not paths and not damping_models:
        text = "name the numbers to fit, such as loop.delay_samples, or a damping model, or all of them"
        raise fail(device.label, "paths", text)
    return device, point


def _validated(
    device: Device,
    records: Sequence[Record],
    checks: list[Check],
    comparison: DampingComparison,
    plan: TrialPlan | None,
    report: Progress,
) -> Identification:
    """Check and validate the best model, and return the result; without numbers where a check refuses them.

    checks  passed so far; gets those of the fit
    plan    of the trials; None where the chart was compared
    """
    model, fit = comparison.model, comparison.best
    checks += [*_check_told_apart(fit), check_explained(model, fit)]
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    if plan is None:
        report("trying other sampling periods", 0, 0)
        checks += check_file_period(model, fit)
        if (nothing := refused(KIND, device.label, checks)) is not None:
            return nothing
    report("validating", 0, 0)
    share, unseen = _validate(model, fit)
    return Identification(
        kind=KIND,
        label=device.label,
        checks=tuple(checks),
        estimates=_estimates(fit),
        validation=share,
        validated_on=unseen,
        remarks=(*_remarks(model, fit, records), *comparison.sentences),
        curves=_curves(model, fit),
        details=_details(model, fit, comparison, plan),
    )


def _own_edge(parameters: BoundaryParameters, point: OperatingPoint) -> EdgeChords:
    """The edge of the file's own chart. Raises DeviceError where the device has none."""
    try:
        return parameters.edge(parameters.start)
    except DeviceError:
        raise
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
        raise fail(parameters.device.label, "", f"has no chart to compare the points with: {error}") from None


def _check_route(point: OperatingPoint, plan: TrialPlan | None) -> Check:
    """Check that says what the points are compared with, and why; a warning of what the chart leaves out.

    plan  of the trials; None: the chart is compared
    """
    if plan is not None:
        return Check("compared with", True, plan.sentence)
    omitted = point.contact_loop.nonlinear.kinds if point.response is None else ()
    text = "the exact chart of the linear device"
    if omitted:
        return Check("compared with", False, f"{text}, which leaves out {comma_list(omitted)}", warning=True)
    return Check("compared with", True, f"{text}, as nothing of it makes the boundary hang on the amplitude")


def _points_beside_edges(
    points: BoundaryPoints, parameters: BoundaryParameters, plan: TrialPlan | None, report: Progress
) -> BoundaryModel:
    """The points beside exact edges, or, with a plan of trials, beside simulated ones."""
    model = BoundaryModel(points, parameters.edge)
    return model if plan is None else model_by_trials(model, parameters, plan, report)


def _lost_point_checks(
    fits: Sequence[tuple[BoundaryModel, BoundaryParameters]], records: Sequence[Record]
) -> list[Check]:
    """A warning that names the points at which the trials of a model have no edge, so that they do not count."""
    checks = list[Check]()
    for model, parameters in fits:
        lost = model.lost if isinstance(model, TrialModel) else None
        if lost is not None and len(lost):
            places = [
                f"{records[lost.record[i]].place(int(lost.row[i]))} of {records[lost.record[i]].label}"
                for i in range(len(lost))
            ]
            of = f" with {parameters.damping.title} damping" if parameters.damping is not None else ""
            text = (
                f"the simulated device{of} has no edge at {plural(len(lost), 'point')}, or loses it as a number "
                f"moves; left out of the fit: {comma_list(places, MOST_LOST_NAMED)}"
            )
            checks.append(Check("trials", False, text, warning=True))
    return checks


def _check_moves_boundary(model: BoundaryModel, parameters: BoundaryParameters) -> Check:
    """Check that each number moves the boundary at all, at the values of the file."""
    J = derivatives(model, parameters.start, first_scatter(model.points))
    names = [what for what, _, _ in parameters.named]
    still = [name for name, column in zip(names, J.T, strict=True) if np.max(np.abs(column)) < NOTHING]
    if still:
        text = (
            f"{comma_list(still)}: the boundary does not move with it in this posture, held as the device is; "
            "leave it out"
        )
        return Check("numbers", False, text)
    return Check("numbers", True, f"the boundary moves with {comma_list(names)}")


def _check_told_apart(fit: BoundaryFit) -> list[Check]:
    """A warning for each pair of numbers of which the points tell little more than a combination; a failed check
    of numbers that they do not tell at all."""
    names = [what for what, _, _ in fit.parameters.named]
    covariance = fit.fit.covariance
    deviations = np.sqrt(np.diag(covariance))
    checks = list[Check]()
    for i in range(len(names)):
        for j in range(i):
            if not (np.isfinite(deviations[[i, j]]).all() and deviations[i] * deviations[j] > 0.0):
                continue
            correlation = float(covariance[i, j] / (deviations[i] * deviations[j]))
            if abs(correlation) > ALIKE:
                text = (
                    f"{names[j]} and {names[i]} change the boundary in nearly the same way (correlation "
                    f"{correlation:.3f}): their combination is known better than either; measure the frequencies, "
                    "or points on the other edge, or fix one"
                )
                checks.append(Check("told apart", False, text, warning=True))
    unknown = [name for name, deviation in zip(names, deviations, strict=True) if not np.isfinite(deviation)]
    if unknown:
        checks.append(Check("told apart", False, f"the points do not tell {comma_list(unknown)} from the others"))
    return checks


def _validate(model: BoundaryModel, fit: BoundaryFit) -> tuple[float, str]:
    """Share of the spread of every third point that a fit to the others explains, nan of too few points; and which
    points these are, a sentence."""
    edges = int(model.points.on_edge.sum())
    kept = kept_points(model.points)
    left = int(np.sum(kept & model.points.on_edge))
    if edges < FEWEST_VALIDATED or left < len(fit.vector) + 1:
        return float("nan"), f"nothing: {plural(edges, 'point')} on the boundary are too few to leave some out"
    again = fit_boundary(model.only(kept), fit.parameters, start=fit.vector, profiled=False)
    unseen = model.only(~kept)
    deviations = unseen.deviations(again.vector, fit.scatter)
    share = share_of_points(unseen.points, deviations.value, fit.scatter)
    return share, (
        f"{edges - left} of {edges} points on the boundary, every third along each edge, predicted by a fit to "
        "the others; the numbers are of all points"
    )


def _estimates(fit: BoundaryFit) -> tuple[Estimate, ...]:
    """The fitted numbers with their intervals."""
    ends = [fit.ends(i) for i in range(len(fit.vector))]
    return tuple(
        Estimate(what, *value_low_high, unit, path)
        for (what, unit, path), value_low_high in zip(fit.parameters.named, ends, strict=True)
    )


def _remarks(model: BoundaryModel, fit: BoundaryFit, records: Sequence[Record]) -> list[str]:
    """A sentence that names the points which lie far beyond the others' scatter; [] where none does."""
    edges = model.points[model.points.on_edge]
    normalised = fit.deviations.value / model.units(fit.scatter)
    typical = 1.4826 * float(np.median(np.abs(normalised)))  # robust standard deviation
    # nothing lies far where all is met but for rounding
    far = np.abs(normalised) > OUTLIER * typical if typical > ROUNDING else np.zeros(len(edges), dtype=bool)
    places = [
        f"{records[edges.record[i]].place(int(edges.row[i]))} of {records[edges.record[i]].label}"
        for i in np.flatnonzero(far)
    ]
    if not places:
        return []
    return [
        f"{plural(len(places), 'point lies', 'points lie')} more than {OUTLIER:g} standard deviations from the "
        f"fitted edge: {comma_list(places, MOST_NAMED)}; all points count in the fit"
    ]


def _curves(model: BoundaryModel, fit: BoundaryFit) -> dict[str, list[Any]]:
    """The points with what was fitted to them, one a row; nan beside walls that were only tried."""
    points, on_edge = model.points, model.points.on_edge
    columns: dict[str, list[Any]] = {
        "stiffness_N_per_m": points.stiffness.tolist(),
        "damping_Ns_per_m": points.damping.tolist(),
        "kind": points.kind.tolist(),
        "frequency_Hz": points.frequency.tolist(),
    }
    for name, values in (
        ("fitted_stiffness_N_per_m", fit.deviations.exact[:, 0]),
        ("fitted_damping_Ns_per_m", fit.deviations.exact[:, 1]),
        ("deviation", fit.deviations.value / model.units(fit.scatter)),
        ("frequency_deviation_Hz", fit.deviations.frequency),
    ):
        column = np.full(len(points), np.nan)
        column[on_edge] = values
        columns[name] = column.tolist()
    return columns


def _details(
    model: BoundaryModel, fit: BoundaryFit, comparison: DampingComparison, plan: TrialPlan | None
) -> dict[str, Any]:
    """The result's further numbers by key: scatter, damping models, and the charts before and after the fit."""

    def outline(vector: Floats) -> list[dict[str, list[float]]]:
        """Arcs of the exact chart's boundary with numbers (p,); [] where there is no chart."""
        try:
            arcs = fit.parameters.chart(vector).boundary
        except (ValueError, ArithmeticError, np.linalg.LinAlgError):
            return []
        return [
            {"stiffness_N_per_m": arc.stiffness.tolist(), "damping_Ns_per_m": arc.damping.tolist()} for arc in arcs
        ]

    return {
        "compared_with": "chart" if plan is None else "experiment",
        "scatter_N_per_m": fit.scatter.stiffness,
        "scatter_Ns_per_m": fit.scatter.damping,
        "scatter_Hz": fit.scatter.frequency if (model.points.frequency > 0.0).any() else None,
        "explained": share_of_points(model.points, fit.deviations.value, fit.scatter),
        "damping_models": comparison.document(),
        "boundary_before": outline(fit.parameters.start),
        "boundary": outline(fit.vector),
    }


TELLING: Final = 6.0  # difference of AICc from which on one model is preferred: odds of 20 to 1
SAME: Final = (
    1e-3  # largest difference of two models' edges, in units of the scatter: no measurement tells them apart
)


@dataclass(frozen=True)
class FittedModel:
    """One model of damping, fitted.

    name, title   of it; "" where the device's own damping was kept
    fit           of its numbers
    criterion     Akaike's, for few points (AICc); bayesian: Schwarz's (BIC); both up to what all models share
    share         of the points' spread that it explains
    """

    name: str
    title: str
    model: BoundaryModel
    fit: BoundaryFit
    criterion: float
    bayesian: float
    share: float


@dataclass(frozen=True)
class DampingComparison:
    """Models of damping fitted to the same points, the best first."""

    models: tuple[FittedModel, ...]

    @property
    def best(self) -> BoundaryFit:
        """The fit of the best model."""
        return self.models[0].fit

    @property
    def model(self) -> BoundaryModel:
        """The points beside the best model's edges."""
        return self.models[0].model

    @property
    def differences(self) -> list[float]:
        """Akaike's criterion of each model less that of the best one."""
        return [one.criterion - self.models[0].criterion for one in self.models]

    @property
    def weights(self) -> list[float]:
        """Odds of each model, as shares of 1: exp(-difference / 2)."""
        odds = np.exp(-0.5 * np.array(self.differences))
        return [float(one) for one in odds / np.sum(odds)]

    @property
    def sentences(self) -> list[str]:
        """What the comparison tells about the models, and which of them it does not tell apart, in words;
        [] of a single model."""
        if len(self.models) < 2:
            return []
        best, *others = self.models
        close = [one for one, apart in zip(others, self.differences[1:], strict=True) if apart < TELLING]
        twins = [one.title for one in close if self._same_edges(one)]
        rest = [one.title for one in close if one.title not in twins]
        lines = []
        if twins:
            lines.append(
                f"{best.title} and {comma_list(twins)} have the same boundary on this device: no measurement of "
                "it tells them apart"
            )
        if rest:
            apart = max(one.criterion for one in close) - best.criterion
            lines.append(
                f"the points do not tell {comma_list([best.title, *rest])} apart (differences of AICc up to "
                f"{apart:.2g}; {TELLING:g} would be odds of 20 to 1)"
            )
        if not close:
            apart = self.differences[1]
            lines.append(
                f"{best.title} explains the points best; {others[0].title} comes next, with odds of 1 to "
                f"{np.exp(0.5 * min(apart, 60.0)):.3g} (difference of AICc {apart:.3g})"
            )
        return lines

    def _same_edges(self, other: FittedModel) -> bool:
        """Whether a model deviates from the points as the best one does, to `SAME` of the scatter."""
        own = self.models[0]
        apart = own.fit.deviations.value - other.fit.deviations.value
        return bool(np.max(np.abs(apart / own.model.units(own.fit.scatter))) < SAME)

    def document(self) -> list[dict[str, Any]]:
        """The models by key, the best first; [] where the device's own damping was kept."""
        return [
            {
                "model": one.name,
                "parameters": [
                    {"name": what, "path": path or None, "value": one.fit.ends(i)[0], "unit": unit}
                    for i, (what, unit, path) in enumerate(one.fit.parameters.named)
                ],
                "aicc_difference": apart,
                "bic_difference": one.bayesian - min(other.bayesian for other in self.models),
                "weight": weight,
                "explained": one.share,
            }
            for one, apart, weight in zip(self.models, self.differences, self.weights, strict=True)
            if one.name
        ]


def compare_models(
    fits: Sequence[tuple[BoundaryModel, BoundaryParameters]], report: Progress
) -> DampingComparison:
    """Fit each model to its points, and the best one again with intervals.

    fits  of each model: the points beside its edges, and its numbers;   report  as `progress` of
          `identify_boundary`
    """
    fitted = list[FittedModel]()
    for number, (model, parameters) in enumerate(fits):
        report("fitting", number, len(fits))
        fitted.append(
            _fitted(model, parameters, _start_of_hysteretic(parameters, fitted), profiled=len(fits) == 1)
        )
    order = sorted(range(len(fitted)), key=lambda i: (fitted[i].criterion, i))
    ranked = [fitted[i] for i in order]
    if len(fits) > 1:
        report("intervals of the best", len(fits), len(fits))
        best = ranked[0]
        ranked[0] = _fitted(best.model, best.fit.parameters, best.fit.vector, profiled=True)
    return DampingComparison(tuple(ranked))


def _start_of_hysteretic(parameters: BoundaryParameters, before: Sequence[FittedModel]) -> Floats | None:
    """Vector (p,) from which a loss factor is fitted: twice the damping ratio that was fitted before, as a search
    is slow; None, so that a start is searched for, of other models.

    before  the models that were fitted already
    """
    if parameters.damping is None or parameters.damping.name != HYSTERETIC:
        return None
    modal = [one.fit.vector for one in before if one.name == MODAL]
    # the last number is the model's, by its logarithm
    return modal[0] + np.append(np.zeros(len(modal[0]) - 1), np.log(2.0)) if modal else None


def _fitted(
    model: BoundaryModel, parameters: BoundaryParameters, start: Floats | None, *, profiled: bool
) -> FittedModel:
    """Fit a model from a start (p,), None: the best of several; with its criteria and share explained.

    profiled  False: intervals by the curvature alone
    """
    fit = fit_boundary(model, parameters, start=start, profiled=profiled)
    minus_twice, count, kinds = log_likelihood(model, fit)
    k = len(fit.vector) + kinds  # numbers, and standard deviations, that were estimated
    correction = 2.0 * k * (k + 1.0) / max(count - k - 1.0, 1.0)
    damping = parameters.damping
    return FittedModel(
        name="" if damping is None else damping.name,
        title="" if damping is None else damping.title,
        model=model,
        fit=fit,
        criterion=minus_twice + 2.0 * k + correction,
        bayesian=minus_twice + k * float(np.log(count)),
        share=share_of_points(model.points, fit.deviations.value, fit.scatter),
    )
