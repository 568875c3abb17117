"""The robot's video and photographs: what the video server is given by the robot."""
