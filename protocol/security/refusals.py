"""Logs refused clients, in so few lines that a client can't fill the disk with them."""

import logging
import threading
from collections import Counter

_log = logging.getLogger(__name__)

_MOST_KNOWN = 1024


class Refusals:
    """Counts refusals by address and reason. May be used by any number of threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counts: Counter[tuple[str, str]] = Counter()
        self._total = 0

    @property
    def total(self) -> int:
        """All refusals so far."""
        return self._total

    def note(self, address: str, reason: str) -> None:
        """A client at an address was refused; logged the 1st, 2nd, 4th, 8th … time."""
        with self._lock:
            self._total += 1
            if len(self._counts) >= _MOST_KNOWN:
                self._counts.clear()
            self._counts[address, reason] += 1
            times = self._counts[address, reason]
        if times & (times - 1) == 0:
            _log.warning(
                "refused %s: %s (%d times so far)",
                address or "a client at an unknown address",
                reason,
                times,
                extra={"peer": address, "reason": reason},
            )
