"""The robot's side of its clients: what they want of it, and what it publishes."""
