"""The best designs found for a task: search, polish, and the front of what cannot be had together."""
