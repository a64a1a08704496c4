"""What connections to workers have counted, taken together: of several roles, and of the processes before this one."""

from protocol.client.dispatcher import Statistics


def total(first: Statistics, second: Statistics) -> Statistics:
    """Every count of both."""
    return Statistics(**{name: getattr(first, name) + getattr(second, name) for name in first.__struct_fields__})
