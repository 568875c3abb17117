"""Evaluation: trajectories and their errors, consistency, traces, and injected faults."""
