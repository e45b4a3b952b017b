"""What the handle feels like over frequency."""
