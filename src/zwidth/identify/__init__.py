"""From measurements of a device to numbers of its file, each with an interval that holds it with 95 %."""
