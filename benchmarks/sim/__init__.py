"""Speed of the simulation, and of whole tours."""
