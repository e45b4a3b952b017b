"""Friction and mass of one joint from its motion."""
