"""Steps of the robot: a queue of straight steps and turns, driven closed-loop under the robot's safety."""
