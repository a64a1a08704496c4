"""Writes down who was turned away, without letting a stranger fill the disk with it."""

import logging
import threading
from collections import Counter

_log = logging.getLogger(__name__)

_MOST_KNOWN = 1024


class Refusals:
    """Counts refusals by who and why. May be used from any number of threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counts: Counter[tuple[str, str]] = Counter()
        self._total = 0

    @property
    def total(self) -> int:
        """All refusals so far."""
        return self._total

    def note(self, address: str, reason: str) -> None:
        """Somebody at an address was refused; said the first time, and then ever more seldom."""
        with self._lock:
            self._total += 1
            if len(self._counts) >= _MOST_KNOWN:
                self._counts.clear()
            self._counts[address, reason] += 1
            times = self._counts[address, reason]
        if times & (times - 1) == 0:
            _log.warning(
                "refused %s: %s (%d times so far)",
                address or "somebody at an unknown address",
                reason,
                times,
                extra={"peer": address, "reason": reason},
            )
