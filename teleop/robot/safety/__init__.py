"""Safety of the robot: who drives, how fast, and what stops it."""
