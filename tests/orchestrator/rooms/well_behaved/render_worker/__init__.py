"""Stands in for the render worker: answers at once, with plain pictures."""
