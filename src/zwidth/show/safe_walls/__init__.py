"""Tables of safe walls as programs for a haptic loop."""
