"""What the robot is localised in: clouds and occupancy grids, read, given normals, prepared."""
