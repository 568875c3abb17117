"""Sweeps: a scenario run over ranges of its fields and over seeds, on all cores or on a cluster."""
