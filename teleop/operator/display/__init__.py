"""The display of the operator station."""
