"""The operator's side: a client of the robot, its display, and ``farsteer operate``."""
