"""Where the robot will go: its answer to commands that are on their way."""
