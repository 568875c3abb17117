"""Where else the robot could be: hints, windows, the whole map, several hypotheses."""
