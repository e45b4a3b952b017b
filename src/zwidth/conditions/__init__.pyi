from .assumptions import Bound as Bound
from .comparison import compare as compare

# Inner names, for tests and neighbouring packages: they may change with any release.
# isort: split
from .comparison import compare_bounds as compare_bounds
from .comparison import exact_stiffness_limit as exact_stiffness_limit
from .spring_stability import spring_stable as spring_stable
