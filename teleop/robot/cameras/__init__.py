"""The robot's camera: when frames are due, their pictures in the wanted formats, and its topics."""
