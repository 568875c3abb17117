"""The robot's parameters and its body in MuJoCo, for several platforms."""
