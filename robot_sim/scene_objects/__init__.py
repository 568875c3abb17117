"""What stands in a world: walls, furniture, glass, slabs, terrain, and their materials."""
