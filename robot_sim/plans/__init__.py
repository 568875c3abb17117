"""Plans: what a world is made of, as values, and as TOML that a person writes."""
