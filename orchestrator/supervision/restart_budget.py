"""How often a process may be restarted, and after what backoff."""

from collections import deque

from protocol.config import SupervisionConfig


class RestartBudget:
    """The budget of one process. Times are seconds of a monotonic clock."""

    def __init__(self, config: SupervisionConfig) -> None:
        self._config = config
        self._restarts: deque[float] = deque()
        self._worked = True

    def charge(self, now: float) -> float | None:
        """Charge a restart; returns the seconds to wait before it, 0 for the first, or None if the budget is spent."""
        self._forget(now)
        if len(self._restarts) >= self._config.max_restarts:
            return None
        pause = self._backoff(len(self._restarts))
        self._restarts.append(now)
        self._worked = False
        return pause

    def worked(self) -> None:
        """Note that the process got ready after its last restart."""
        self._worked = True

    def _forget(self, now: float) -> None:
        # Otherwise a process that takes longer than the window to start, and never gets ready, is restarted for ever.
        while self._worked and self._restarts and now - self._restarts[0] >= self._config.window:
            self._restarts.popleft()

    def _backoff(self, restarts: int) -> float:
        if restarts == 0:
            return 0.0
        return min(self._config.max_backoff, self._config.initial_backoff * 2.0 ** min(restarts - 1, 30))
