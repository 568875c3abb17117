"""The localiser: readings are validated, ordered, and folded into one state that yields estimates."""
