"""A queue of jobs for handler threads.

The idle thread that worked last gets the next job, since its core's caches still hold what it needs. Only that thread
is woken, while a `SimpleQueue` also wakes a second one with each job, in vain.
"""

import threading
from collections import deque
from typing import Generic, TypeVar

JobT = TypeVar("JobT")


class _Idle(Generic[JobT]):
    """A thread that waits, and the job that it was given."""

    def __init__(self) -> None:
        self.given: list[JobT] = []
        self.wakes = threading.Lock()
        self.wakes.acquire()


class Jobs(Generic[JobT]):
    """A queue that any number of threads may put to and get from."""

    def __init__(self) -> None:
        self._in_use = threading.Lock()
        self._waiting: deque[JobT] = deque()
        self._idle: list[_Idle[JobT]] = []

    def put(self, job: JobT) -> None:
        """Put a job; threads get jobs in the order in which they were put."""
        with self._in_use:
            if not self._idle:
                self._waiting.append(job)
                return
            thread = self._idle.pop()
            thread.given.append(job)
        thread.wakes.release()

    def get(self) -> JobT:
        """Wait for a job. If a signal handler raises in the waiting thread, the job goes to the next thread."""
        with self._in_use:
            if self._waiting:
                return self._waiting.popleft()
            thread: _Idle[JobT] = _Idle()
            self._idle.append(thread)
        try:
            thread.wakes.acquire()
        except BaseException:
            self._leave(thread)
            raise
        return thread.given[0]

    def take_all(self) -> list[JobT]:
        """The jobs that no thread has taken."""
        with self._in_use:
            jobs = list(self._waiting)
            self._waiting.clear()
        return jobs

    def _leave(self, thread: _Idle[JobT]) -> None:
        with self._in_use:
            if thread in self._idle:
                self._idle.remove(thread)
            self._waiting.extendleft(thread.given)
