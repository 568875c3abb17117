"""The localiser beside its peers in simulated scenes, its files and its maps."""
