"""Safe walls over the workspace: ranges of stiffness and damping that are stable in every posture of a cell."""
