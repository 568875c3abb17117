"""What moves by itself: people, doors and carts."""
