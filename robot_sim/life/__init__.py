"""What moves on its own: people, doors and carts."""
