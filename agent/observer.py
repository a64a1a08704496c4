"""Who watches a training or an evaluation from within its process, such as its metrics: all that the agent knows of it.

It is told, and never asked: what it does can't change what is learned.
"""

from contextlib import AbstractContextManager, nullcontext
from typing import Protocol

from protocol.records import Progress


class Observer(Protocol):
    """Called by the thread that flies, so it neither waits nor raises."""

    def progress(self, record: Progress) -> None:
        """So far it is; told about once a second."""
        ...

    def checkpoint(self) -> AbstractContextManager[None]:
        """Open while a checkpoint is written; left by an error where that fails."""
        ...


class _Nobody:
    def progress(self, record: Progress) -> None:
        pass

    def checkpoint(self) -> AbstractContextManager[None]:
        return nullcontext()


NOBODY: Observer = _Nobody()
"""Watches nothing."""
