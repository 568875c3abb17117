"""Simulated missions: world, faults and limits; driving, recording and evaluating them."""
