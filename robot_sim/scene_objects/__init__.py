"""Objects of a world: walls, furniture, glass, ramps and steps, terrain, and their materials."""
