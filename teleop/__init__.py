"""Teleoperation: the robot behind a WebSocket, its operator, scenarios, and the command line."""
