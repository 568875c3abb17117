"""A run of a scenario: its robot, its faults at their times, who drives, and what is kept of it."""
