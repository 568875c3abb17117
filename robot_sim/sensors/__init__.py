"""Planar scanners, what befalls their light, and the inertial unit."""
