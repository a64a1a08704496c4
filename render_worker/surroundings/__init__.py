"""What stands around people: walls, ground, sky and light."""
