"""The referee: watches each tick beside the robot, and judges the run by its limits."""
