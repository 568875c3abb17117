"""The link between an operator and the robot: how old commands are, and links that are slow on purpose."""
