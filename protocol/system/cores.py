"""The cores that this process may use."""

import os


def available_cores() -> int:
    """How many there are: a container or a job may be allowed fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
