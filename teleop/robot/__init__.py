"""The robot: one tick that turns commands and readings into a snapshot."""
