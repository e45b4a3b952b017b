"""Modes and the device's own numbers from force and position."""
