"""Where is the robot? Readings in, estimates out; no simulator, no network."""
