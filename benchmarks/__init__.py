"""Measurements of the whole system, outside of the tests; each module is a command and documents its output."""
