"""Actors that move by themselves: people, doors and carts."""
