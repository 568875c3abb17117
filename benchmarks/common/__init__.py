"""Figures, the sheets that keep them, and how far a long benchmark is."""
