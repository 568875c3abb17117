"""Mapping: clouds built from a drive, with known poses or by graph SLAM without them."""
