"""What is lost without each of the localiser's mechanisms."""
