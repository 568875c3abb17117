"""What if: a recorded run forked at a time, with a fault that it did not have, and both futures side by side."""
