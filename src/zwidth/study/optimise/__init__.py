"""The best designs of a device for a task: search, polish, and the front of what cannot be had together."""
