"""The CPU cores that this process may use."""

import os


def available_cores() -> int:
    """The number of cores; a container or a job may be allowed fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
