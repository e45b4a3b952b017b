"""A study in parallel: two processes at most, a folder that keeps what is done, and a second start after a stop.

Every batch of designs is kept in the folder once it is computed: after ctrl-C or a crash the same call continues
where it was. Processes start where the rest would take more than ten seconds, which this study does not; numbers
are the same to the last bit, whichever process computes them.
"""

from tempfile import TemporaryDirectory

import zwidth

device = zwidth.load("five-bar")
axes = {"drives.motor-right.stiffness_Nm_per_rad": [0.3, 0.45, 0.6, 0.9], "loop.delay_samples": [0.0, 0.5, 1.0]}
reports = []


def follow(stage, done, of):
    """Note how far it is, and stop the first run after five designs as ctrl-C would."""
    reports.append(f"{done} of {of}")
    if len(reports) == 6:
        raise KeyboardInterrupt


with TemporaryDirectory() as folder:
    options = {"store": f"{folder}/study", "workers": 2, "progress": follow}
    try:
        zwidth.sweep(device, axes, "stiffness_max", **options)
    except KeyboardInterrupt:
        print(f"stopped after {reports[-1]}")
    results = zwidth.sweep(device, axes, "stiffness_max", **options)
    print(f"began again with {reports[6]}, and ended with {reports[-1]}")
print(f"the stiffest: {results['stiffness_max'].max():.0f} N/m")
