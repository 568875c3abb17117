"""Drives that are recorded once and replayed to any method."""
