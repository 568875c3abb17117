"""A rosbridge client that reconnects."""
