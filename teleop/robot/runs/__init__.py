"""Runs: drives that clients have recorded on the robot, to be looked at again in the console."""
