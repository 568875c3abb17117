"""Maps made of a drive, with known poses or without."""
