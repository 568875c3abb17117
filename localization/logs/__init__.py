"""Readings in files: our own logs, ROS bags and CARMEN texts, in one shape."""
