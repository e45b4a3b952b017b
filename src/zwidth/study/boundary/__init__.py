"""Stability boundaries measured by trying walls: on the virtual device, or read from a file."""
