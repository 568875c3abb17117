"""Endless made-up buildings, each from a seed and an area."""

from robot_sim.building_generator.building import AREAS, MARGIN, Building, Room, generate

__all__ = ["AREAS", "MARGIN", "Building", "Room", "generate"]
