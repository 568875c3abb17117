"""Scenes as data: one folder each, with its floor plan, its point cloud and what to know about it."""
