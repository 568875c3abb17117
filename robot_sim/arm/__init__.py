"""The arm: its numbers, kinematics, body, servos and loads."""
