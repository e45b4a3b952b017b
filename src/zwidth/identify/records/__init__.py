"""Records of a bench: columns, reading in pieces, sampling, averages."""
