from .coupling import couplings as couplings
from .nested import Guarantees as Guarantees
from .nested import nested as nested
from .passive import passive_region as passive_region
from .region import Region as Region
from .springs import spring_stable_region as spring_stable_region
