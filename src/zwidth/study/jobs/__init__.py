"""Long computations: many cells in several processes, stored as they come, continued where they stopped."""
