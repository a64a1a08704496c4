"""Stands in for the perception worker: answers at once, with a person it was told about."""
