"""Attacks on a served robot, beside a driver and a second client."""
