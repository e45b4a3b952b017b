"""A frequency response from raw sweeps."""
