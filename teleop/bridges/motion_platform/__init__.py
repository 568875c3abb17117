"""A chair on a motion base that tilts as the robot does."""
