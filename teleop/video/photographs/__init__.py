"""Photographs on command: stored with pose, stamp and map, listed and fetched over HTTP."""
