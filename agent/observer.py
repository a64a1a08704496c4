"""An observer of a training or an evaluation within its process, such as its metrics.

The agent calls it and never asks it: an observer can't change what is learned.
"""

from contextlib import AbstractContextManager, nullcontext
from typing import Protocol

from protocol.records import Progress


class Observer(Protocol):
    """Called by the thread that flies, so it neither waits nor raises."""

    def progress(self, record: Progress) -> None:
        """Called about once a second with how far the agent is."""
        ...

    def checkpoint(self) -> AbstractContextManager[None]:
        """Open while a checkpoint is written; left by an error where that fails."""
        ...


class _NoObserver:
    def progress(self, record: Progress) -> None:
        pass

    def checkpoint(self) -> AbstractContextManager[None]:
        return nullcontext()


NO_OBSERVER: Observer = _NoObserver()
"""An observer that does nothing."""
