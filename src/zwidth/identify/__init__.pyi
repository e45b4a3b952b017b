from .arm.identify import identify_arm as identify_arm
from .boundary.identify import identify_boundary as identify_boundary
from .identification import Estimate as Estimate
from .identification import Identification as Identification
from .impedance.identify import identify_impedance as identify_impedance
from .joint.friction import identify_friction as identify_friction
from .joint.friction import identify_mass as identify_mass
from .kinds import KINDS as KINDS
from .kinds import identify as identify
from .modes.identify import identify_modes as identify_modes
from .records.record import read_record as read_record
from .records.record import record_of as record_of
from .response.identify import identify_response as identify_response
from .stiffness.identify import identify_stiffness as identify_stiffness

# Inner names, for tests and neighbouring packages: they may change with any release.
# isort: split
from .arm.parameters import Parameters as Parameters
from .arm.parameters import base_parameters as base_parameters
from .boundary.fit import fit_boundary as fit_boundary
from .boundary.model import BoundaryModel as BoundaryModel
from .boundary.parameters import BoundaryParameters as BoundaryParameters
from .boundary.points import read_boundary_points as read_boundary_points
from .profile_likelihood import fit_least_squares as fit_least_squares
from .records.record import Columns as Columns
from .records.sampling import check_sampling as check_sampling
from .response.identify import SweepBlocks as SweepBlocks
