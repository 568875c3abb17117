"""Driving with and without the guard."""
