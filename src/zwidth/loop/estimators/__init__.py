"""Velocity estimates from positions: one method per file, most a discrete transfer function w(z).

Every linear method has `estimator(period)`, its factors at a sampling period [s]; `delay(period)`, how late it is
at low frequencies [s]; and `noise_gain(period)`, the standard deviation of the estimate per that of white noise in
the position [1/s]. All lengths are in metres, all times in seconds. Their frequency responses are in
`zwidth.loop.estimators.frequency_response`.

Two methods are not linear, `Foaw` and `Levant`: they have no w(z), `estimator` raises NonlinearError, and a loop
with them is simulated instead. `zwidth.loop.estimators.kernels` runs any method over recorded positions.
"""

from zwidth.loop.estimator import BackwardDifference, CentralDifference, WindowedDifference
from zwidth.loop.estimators.alpha_beta import AlphaBeta
from zwidth.loop.estimators.foaw import Foaw
from zwidth.loop.estimators.kalman import Kalman
from zwidth.loop.estimators.least_squares_slope import LeastSquaresSlope
from zwidth.loop.estimators.levant import Levant
from zwidth.loop.estimators.savitzky_golay import SavitzkyGolay

LinearMethod = (
    BackwardDifference
    | WindowedDifference
    | LeastSquaresSlope
    | CentralDifference
    | SavitzkyGolay
    | AlphaBeta
    | Kalman
)
VelocityMethod = LinearMethod | Foaw | Levant

# By the names of device files.
LINEAR_METHODS: dict[str, type[LinearMethod]] = {
    "backward-difference": BackwardDifference,
    "windowed-difference": WindowedDifference,
    "least-squares-slope": LeastSquaresSlope,
    "central-difference": CentralDifference,
    "savitzky-golay": SavitzkyGolay,
    "alpha-beta": AlphaBeta,
    "kalman": Kalman,
}
METHODS: dict[str, type[VelocityMethod]] = {**LINEAR_METHODS, "foaw": Foaw, "levant": Levant}

__all__ = [
    "LINEAR_METHODS",
    "METHODS",
    "AlphaBeta",
    "BackwardDifference",
    "CentralDifference",
    "Foaw",
    "Kalman",
    "LeastSquaresSlope",
    "Levant",
    "LinearMethod",
    "SavitzkyGolay",
    "VelocityMethod",
    "WindowedDifference",
]
