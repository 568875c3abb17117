"""The terminal of the operator station."""
