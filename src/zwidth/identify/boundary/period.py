"""Whether a measured boundary is that of another sampling period than the device file's."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.device.faults import DeviceError
from zwidth.identify.boundary.fit import BoundaryFit, fit_boundary, log_likelihood
from zwidth.identify.boundary.model import BoundaryModel
from zwidth.identify.boundary.parameters import BoundaryParameters
from zwidth.identify.identification import Check

PERIOD: Final = "loop.sampling_period_s"
BY_CHANCE: Final = 1e-4  # probability below which a better fit is not by scatter
SAME_PERIOD: Final = 0.01  # relative difference of the periods below which nothing is said
OFF: Final = 0.1  # relative difference of the periods that is a fault of the file in any case


def check_period(model: BoundaryModel, fit: BoundaryFit) -> list[Check]:
    """Whether the points are explained much better by a sampling period other than the file's; [] where they are
    not, or where the period is fitted already.

    The fit is repeated with the period as a further number. With n points, p numbers before, and D the drop of
    minus twice the log-likelihood, (exp(D / n) - 1) (n - p - 1) has Fisher's distribution with 1 and n - p - 1
    degrees of freedom if the file is right.

    How often, with up to 24 points on random devices of two masses, scatter of 0.1-2 %, and the delay fitted: of
    60 periods 30 % too long 51 were refused (D 21 to 180), 9 not even warned of (D 1.9 to 17); of 110 right ones
    none.
    """
    from scipy.stats import f

    given = fit.parameters
    paths = given.numbers.paths
    if PERIOD in paths or given.point.response is not None:
        return []
    before, count, _ = log_likelihood(model, fit)
    freedom = count - len(fit.vector) - 1
    if freedom < 1:
        return []
    try:
        wider = BoundaryParameters.of(given.device, given.point, [*paths, PERIOD], given.damping)
        start = np.insert(fit.vector, len(paths), wider.start[len(paths)])
        freed = BoundaryModel(model.points, wider.edge)
        found = fit_boundary(freed, wider, start=start, profiled=False)
    except (DeviceError, ValueError, ArithmeticError, np.linalg.LinAlgError):
        return []  # no chart, or no period but the file's is allowed
    drop = before - log_likelihood(freed, found)[0]
    chance = float(f.sf(np.expm1(max(drop, 0.0) / count) * freedom, 1, freedom))
    own, better = (float(wider.values(vector)[len(paths)]) for vector in (start, found.vector))
    if chance > BY_CHANCE or abs(better / own - 1.0) < SAME_PERIOD:
        return []
    text = (
        f"{better:.4g} s explains the points better than the {own:.4g} s of the file, by {drop:.3g} in twice the "
        "log-likelihood"
    )
    if abs(better / own - 1.0) > OFF:
        text += (
            f": correct {PERIOD}; if it is right, another number that is held fixed is not (delay, filter, "
            "masses, posture)"
        )
        return [Check("sampling period", False, text)]
    text += f": is {PERIOD} right? Else another number that is held fixed is a little wrong"
    return [Check("sampling period", False, text, warning=True)]
