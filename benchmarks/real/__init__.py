"""Localisation on real CARMEN logs beside other methods."""
