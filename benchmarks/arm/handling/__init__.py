"""Boxes in the arm's jaws: picked, carried and placed."""
