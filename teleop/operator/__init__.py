"""The operator station: a client of the robot and its display."""
