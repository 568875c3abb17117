"""The guard: what keeps the robot from driving into what its scanners see, and says why."""
