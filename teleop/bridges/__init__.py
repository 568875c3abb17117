"""Bridges between a robot and other networks; each is one client of the robot among others."""
