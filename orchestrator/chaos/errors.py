"""Errors of a rehearsal.

VantageError
└── RehearsalFailed       a rehearsal could not be completed
    ├── NotRecovered        the run did not recover from a fault in time
    ├── RunEnded            the run ended before a fault could happen
    └── InvariantBroken     an invariant does not hold after a fault
"""

from protocol.errors import VantageError


class RehearsalFailed(VantageError):
    """A rehearsal could not be completed."""


class NotRecovered(RehearsalFailed):
    """The run did not recover from a fault in time."""


class RunEnded(RehearsalFailed):
    """The run ended before a fault could happen."""


class InvariantBroken(RehearsalFailed):
    """An invariant does not hold after a fault."""
