"""The robot's body in numbers and in MuJoCo, platform by platform."""
