"""The tour: a drive past the way-points of a world by a station in a process of its own, and the report of it."""
