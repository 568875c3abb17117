"""Floor plans: the contents of a world as values and as TOML files."""
