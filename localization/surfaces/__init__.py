"""A building's surfaces, computed once from its cloud: walls with openings, the floor, furniture; as glTF."""
