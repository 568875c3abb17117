"""How precisely a robot drives steps: by its own queue, and by a client that drives by time alone."""
