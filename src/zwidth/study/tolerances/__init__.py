"""Devices as they are produced: numbers that differ from one to the next, and what that does to the walls."""
