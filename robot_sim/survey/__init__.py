"""What outsiders see of a world: a total station, a camera, the surfaces themselves."""
