"""Calibration of the scanners' mounts from a drive through a mapped place."""
