"""Estimates against ground truth, trajectories and traces in files, injected faults."""
