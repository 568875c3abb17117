"""Planar lidars with optical effects, and the inertial unit."""
