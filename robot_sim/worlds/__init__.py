"""Worlds: floor plans and MJCF files compiled into MuJoCo models with the robot in them."""
