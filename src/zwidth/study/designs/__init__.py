"""Many designs of one device, from a study file or from Python, and the measures of each."""
