"""Topics and services of the robot, and the messages on them."""
