"""Cameras and their video, from the renderer to a viewer."""
