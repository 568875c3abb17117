"""What the operator station knows of the robot and of the link."""
