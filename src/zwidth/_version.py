"""The version, for those that only want to state it."""

__version__ = "0.1.0"
