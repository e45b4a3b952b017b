from .controller import Butterworth as Butterworth
from .controller import Controller as Controller
from .controller import FirstOrder as FirstOrder
from .estimators import AlphaBeta as AlphaBeta
from .estimators import BackwardDifference as BackwardDifference
from .estimators import CentralDifference as CentralDifference
from .estimators import Foaw as Foaw
from .estimators import Kalman as Kalman
from .estimators import LeastSquaresSlope as LeastSquaresSlope
from .estimators import Levant as Levant
from .estimators import SavitzkyGolay as SavitzkyGolay
from .estimators import WindowedDifference as WindowedDifference
from .estimators.kernels import velocity_of as velocity_of
from .loop import Loop as Loop
from .multi_loop import MultiLoop as MultiLoop
from .operating_point import OperatingPoint as OperatingPoint
from .wall_matrices import WallMatrices as WallMatrices

# Inner names, for tests and neighbouring packages: they may change with any release.
# isort: split
from .controller import Feedforward as Feedforward
from .controller import ForceSensor as ForceSensor
from .controller import LocalLoop as LocalLoop
from .estimator import quantisation_noise as quantisation_noise
from .estimators import LINEAR_METHODS as LINEAR_METHODS
from .estimators import METHODS as METHODS
from .estimators.frequency_response import phase_delay as phase_delay
from .estimators.frequency_response import relative_response as relative_response
from .factor_response import feedforward_response as feedforward_response
from .factor_response import rows_response as rows_response
from .loop import SidewaysMotion as SidewaysMotion
from .loop_table import table_of_loops as table_of_loops
from .realisation import CHAINED as CHAINED
from .sections import section_rows as section_rows
