"""What happens on contact: the loop in time, with all that is not linear about it."""
