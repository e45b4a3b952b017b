"""4.3: which model of the published plant tells the same as its two masses, and at which vibration.

Each wall on the edge of the stable ones has the frequency at which it starts to vibrate. At each, a simpler model
is off by the least share by which stiffness, damping and frequency must all be allowed to differ for its edge to
pass there (`zwidth.study.validity`); here is asked where that stays within 10 %.
"""

from __future__ import annotations

from gallery.shared_loops import PUBLISHED
from zwidth.device.load import load
from zwidth.study import validity

model_validity = validity(load(PUBLISHED).at())
fits = {fit.key: fit for fit in model_validity.fits}
natural = model_validity.first_natural
lowest, highest = float(model_validity.frequency[0]), float(model_validity.frequency[-1])

rigid, motor, motor_undamped = (fits[key].valid_ranges for key in ("rigid", "motor-mass", "motor-mass-undamped"))
rigid_below = rigid[-1][1]
motor_above = motor[0][0]
