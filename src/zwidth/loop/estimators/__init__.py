"""How the velocity is estimated from positions: one method per file, each a discrete transfer function w(z).

Every method has `estimator(period)`, its factors at a sampling period; `delay(period)`, how late it is at low
frequencies; and `noise_gain(period)`, how much of the position's white noise it passes. None takes or keeps a unit
but metres and seconds. Their frequency responses are in `zwidth.loop.estimators.response`.
"""

from zwidth.loop.estimators.alpha_beta import AlphaBeta
from zwidth.loop.estimators.backward_difference import BackwardDifference
from zwidth.loop.estimators.central_difference import CentralDifference
from zwidth.loop.estimators.kalman import Kalman
from zwidth.loop.estimators.least_squares_slope import LeastSquaresSlope
from zwidth.loop.estimators.savitzky_golay import SavitzkyGolay
from zwidth.loop.estimators.windowed_difference import WindowedDifference

VelocityMethod = (
    BackwardDifference
    | WindowedDifference
    | LeastSquaresSlope
    | CentralDifference
    | SavitzkyGolay
    | AlphaBeta
    | Kalman
)

# By the names of device files.
METHODS: dict[str, type[VelocityMethod]] = {
    "backward-difference": BackwardDifference,
    "windowed-difference": WindowedDifference,
    "least-squares-slope": LeastSquaresSlope,
    "central-difference": CentralDifference,
    "savitzky-golay": SavitzkyGolay,
    "alpha-beta": AlphaBeta,
    "kalman": Kalman,
}

__all__ = [
    "METHODS",
    "AlphaBeta",
    "BackwardDifference",
    "CentralDifference",
    "Kalman",
    "LeastSquaresSlope",
    "SavitzkyGolay",
    "VelocityMethod",
    "WindowedDifference",
]
