"""The people in a scene: bodies, poses, clothes and hair."""
