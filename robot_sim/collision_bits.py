"""Bits and groups by which parts of a model collide, and by which scanners distinguish the robot from the world."""

from __future__ import annotations

from typing import Final

ROBOT_GROUP: Final = 3
"""Geom group of the robot, which its own lidars do not see."""
OBSTACLE_BIT: Final = 1
"""Collision bit of obstacles and of the robot's own hull."""
FLOOR_BIT: Final = 2
"""Collision bit of drivable surfaces. Tyres touch them in pairs of their own; of the rest only
parts that touch the ground when the robot bottoms out or falls have it, and what can lie on it."""
ARM_BIT: Final = 1 << 29
"""Collision bit of the lower part of an arm, which its own upper part can hit."""
MOVER_BIT: Final = 1 << 30
"""Collision bit of movers: they collide with the robot's bumper geom and its arm only."""
