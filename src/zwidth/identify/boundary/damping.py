"""Which of several models of damping explains a measured boundary best, and whether the points can tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.faults import comma_list
from zwidth.identify.boundary.damping_models import HYSTERETIC, MODAL
from zwidth.identify.boundary.explained import share_of_points
from zwidth.identify.boundary.fit import BoundaryFit, fit_boundary, log_likelihood
from zwidth.identify.boundary.model import BoundaryModel
from zwidth.identify.boundary.parameters import BoundaryParameters
from zwidth.progress import Progress

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
        """Of Akaike's criterion, of each model from the best."""
        return [one.criterion - self.models[0].criterion for one in self.models]

    @property
    def weights(self) -> list[float]:
        """Odds of each model, as shares of 1: exp(-difference / 2)."""
        odds = np.exp(-0.5 * np.array(self.differences))
        return [float(one) for one in odds / np.sum(odds)]

    @property
    def sentences(self) -> list[str]:
        """What the comparison says, and what it does not."""
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
        """Whether a model's edges pass the points as the best one's do."""
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
    """Fit each model to its points, and the best one again with intervals."""
    fitted = list[FittedModel]()
    for number, (model, parameters) in enumerate(fits):
        report("fitting", number, len(fits))
        fitted.append(_fitted(model, parameters, _start(parameters, fitted), profiled=len(fits) == 1))
    order = sorted(range(len(fitted)), key=lambda i: (fitted[i].criterion, i))
    ranked = [fitted[i] for i in order]
    if len(fits) > 1:
        report("intervals of the best", len(fits), len(fits))
        best = ranked[0]
        ranked[0] = _fitted(best.model, best.fit.parameters, best.fit.vector, profiled=True)
    return DampingComparison(tuple(ranked))


def _start(parameters: BoundaryParameters, before: Sequence[FittedModel]) -> Floats | None:
    """A loss factor begins at twice the damping ratio that was fitted, as a search is slow; None: search."""
    if parameters.damping is None or parameters.damping.name != HYSTERETIC:
        return None
    modal = [one.fit.vector for one in before if one.name == MODAL]
    return modal[0] + np.append(np.zeros(len(modal[0]) - 1), np.log(2.0)) if modal else None


def _fitted(
    model: BoundaryModel, parameters: BoundaryParameters, start: Floats | None, *, profiled: bool
) -> FittedModel:
    fit = fit_boundary(model, parameters, start=start, profiled=profiled)
    minus_twice, count, kinds = log_likelihood(model, fit)
    k = len(fit.vector) + kinds
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
