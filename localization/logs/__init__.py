"""Logs of readings: our own MCAP files, ROS bags and CARMEN texts behind one interface."""
