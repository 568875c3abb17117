"""What stands in a world and what it is made of: walls, furniture, glass, slabs, terrain."""
