from .coupling import couplings as couplings
from .guarantees import Guarantees as Guarantees
from .loop_guarantees import find_guarantees as find_guarantees
from .passive import passive_region as passive_region
from .region import Region as Region
from .spring_stable import spring_stable_region as spring_stable_region

# Inner names, for tests and neighbouring packages: they may change with any release.
# isort: split
from .disks import response_disks as response_disks
from .loop_guarantees import guarantees_of as guarantees_of
from .port import without_idle_motions as without_idle_motions
from .spring_family import SpringFamily as SpringFamily
