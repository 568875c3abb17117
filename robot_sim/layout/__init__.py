"""Free space and routes of a floor plan, rearranged furniture, and plans from occupancy maps."""
