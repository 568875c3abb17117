"""Figures of the documentation, drawn from the simulation."""
