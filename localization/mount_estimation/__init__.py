"""Estimation of scanner mounts from sweeps in a known map: one least-squares problem, on line and off line."""
