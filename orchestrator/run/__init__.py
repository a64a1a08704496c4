"""A run's directory: what is recorded in it, who holds it, and how its state is read."""
