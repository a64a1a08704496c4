"""Jobs on their way to the threads that handle them.

Of those that are idle, the one that was at work last gets the next job: what it needs is still in its core's caches.
And it alone is woken, while a `SimpleQueue` wakes a second one with each job, in vain.
"""

import threading
from collections import deque
from typing import Generic, TypeVar

JobT = TypeVar("JobT")


class _Idle(Generic[JobT]):
    """A thread that waits, and the job that it is given."""

    def __init__(self) -> None:
        self.given: list[JobT] = []
        self.wakes = threading.Lock()
        self.wakes.acquire()


class Jobs(Generic[JobT]):
    """A queue with any number of threads at both ends."""

    def __init__(self) -> None:
        self._in_use = threading.Lock()
        self._waiting: deque[JobT] = deque()
        self._idle: list[_Idle[JobT]] = []

    def put(self, job: JobT) -> None:
        """Hand over a job; the threads get them in the order in which they were put."""
        with self._in_use:
            if not self._idle:
                self._waiting.append(job)
                return
            thread = self._idle.pop()
            thread.given.append(job)
        thread.wakes.release()

    def get(self) -> JobT:
        """Wait for a job. One that is given to a thread which a signal ends meanwhile goes to the next."""
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
