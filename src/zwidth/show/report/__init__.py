"""The report: one self-contained page on one device."""
