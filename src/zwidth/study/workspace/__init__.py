"""Measures over the workspace: maps, areas with required properties, directions."""
