"""Failures of drivers, links and the robot's own processes, while it drives: does it stand in time?"""
