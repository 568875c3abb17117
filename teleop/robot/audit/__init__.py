"""The audit log of the robot: who commanded what, and what was rejected."""
