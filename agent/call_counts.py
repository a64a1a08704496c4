"""Sums of the counts of connections to workers: over several roles, and over earlier processes of a run."""

from protocol.client.dispatcher import Statistics


def total(first: Statistics, second: Statistics) -> Statistics:
    """The sum of each count."""
    return Statistics(**{name: getattr(first, name) + getattr(second, name) for name in first.__struct_fields__})
