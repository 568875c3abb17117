"""Missions with a world, faults and limits, driven, judged and reported."""
