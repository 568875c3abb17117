"""Floor plans: what a world is made of, as values and as TOML files."""
