"""Walls that are stable for every operator of a list, and for all numbers within their ranges."""
