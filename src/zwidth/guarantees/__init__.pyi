from .coupling import couplings as couplings
from .guarantees import Guarantees as Guarantees
from .loop_guarantees import find_guarantees as find_guarantees
from .passive import passive_region as passive_region
from .region import Region as Region
from .spring_stable import spring_stable_region as spring_stable_region
