"""Finds that it can't render, says why, and ends."""
