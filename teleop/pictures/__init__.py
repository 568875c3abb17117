"""Pictures of the robot's cameras on their way to viewers."""
