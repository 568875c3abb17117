"""Generator of furnished buildings, each from a seed and an area."""

from robot_sim.building_generator.building import AREAS, Building, Room, generate

__all__ = ["AREAS", "Building", "Room", "generate"]
