"""Packing of pictures for the way between machines: as JPEG, or without loss."""
