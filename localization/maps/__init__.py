"""Maps: point clouds and occupancy grids, their normals, and their preparation for matching."""
