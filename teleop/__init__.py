"""From far away: the robot's WebSocket, its operator, its scenarios, and the command line."""
