"""Rules that hold in every run, by any operator and with any fault; each is independent of the robot's code."""
