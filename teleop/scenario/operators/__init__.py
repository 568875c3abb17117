"""Operators of the library: they see and send only what goes over the wire."""
