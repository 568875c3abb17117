"""Pictures of the documentation, drawn from the simulation and from kept figures."""
