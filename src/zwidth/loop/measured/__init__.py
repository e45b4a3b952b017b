"""A measured device held by somebody, faster, slower or later than it was measured: what the data alone allow."""
