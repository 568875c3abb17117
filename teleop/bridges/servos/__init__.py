"""The arm of a robot on a board of hobby servos: angles out, angles back."""
