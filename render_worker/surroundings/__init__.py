"""The surroundings of people: walls, ground, sky and light."""
