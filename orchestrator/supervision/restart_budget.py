"""How often a process may be started again, and after what pause."""

from collections import deque

from protocol.config import SupervisionConfig


class RestartBudget:
    """One process's. Times are seconds of any clock that only goes forward."""

    def __init__(self, config: SupervisionConfig) -> None:
        self._config = config
        self._restarts: deque[float] = deque()
        self._worked = True

    def charge(self, now: float) -> float | None:
        """The pause before the next restart, in seconds: none before the first; None where the budget is spent."""
        self._forget(now)
        if len(self._restarts) >= self._config.max_restarts:
            return None
        pause = self._backoff(len(self._restarts))
        self._restarts.append(now)
        self._worked = False
        return pause

    def worked(self) -> None:
        """The process got ready since its last restart."""
        self._worked = True

    def _forget(self, now: float) -> None:
        # What takes longer than the window to start and never gets ready would else be started for ever.
        while self._worked and self._restarts and now - self._restarts[0] >= self._config.window:
            self._restarts.popleft()

    def _backoff(self, restarts: int) -> float:
        if restarts == 0:
            return 0.0
        return min(self._config.max_backoff, self._config.initial_backoff * 2.0 ** min(restarts - 1, 30))
