"""Stiffness of a drive from torque over angle."""
