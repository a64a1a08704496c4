"""What can go wrong in a rehearsal.

VantageError
└── RehearsalFailed       a rehearsal could not be carried through
    ├── NotRecovered        what a fault had stopped did not come back in time
    ├── RunEnded            the run ended while something was still to happen to it
    └── InvariantBroken     after a fault something is otherwise than it may be
"""

from protocol.errors import VantageError


class RehearsalFailed(VantageError):
    """A rehearsal could not be carried through."""


class NotRecovered(RehearsalFailed):
    """What a fault had stopped did not come back in time."""


class RunEnded(RehearsalFailed):
    """The run ended while something was still to happen to it."""


class InvariantBroken(RehearsalFailed):
    """After a fault something is otherwise than it may be."""
