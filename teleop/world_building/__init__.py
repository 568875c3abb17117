"""Making and mapping worlds: generated buildings, surveys, scene folders and their pictures."""
