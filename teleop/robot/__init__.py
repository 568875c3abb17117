"""The robot's side: its tick, its safety, its rosbridge topics, and ``farsteer serve``."""
