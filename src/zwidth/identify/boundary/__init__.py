"""Numbers of a device from a measured stability boundary."""
