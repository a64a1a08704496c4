"""How long anything may take: startup, liveness and progress have a clock each."""

import math

from msgspec.structs import asdict

from protocol.config import TimeoutsConfig
from protocol.errors import InvalidConfig


class Timeouts(TimeoutsConfig, frozen=True, kw_only=True):
    """Seconds: those that a configuration sets, and those of the transport, which no configuration sets.

    Attributes:
        silence: a connection on which nothing arrives for this long is closed and opened again.
        initial_backoff, max_backoff: pause before the second try of a request; it doubles with each further one.

    Raises:
        InvalidConfig: a value is not positive and finite.
    """

    silence: float = 10.0
    initial_backoff: float = 0.05
    max_backoff: float = 1.0

    def __post_init__(self) -> None:
        for name, seconds in asdict(self).items():
            if not 0 < seconds < math.inf:
                raise InvalidConfig(f"timeouts.{name} is {seconds}; it must be positive and finite")

    @classmethod
    def from_config(cls, config: TimeoutsConfig) -> "Timeouts":
        """The timeouts of a run's configuration, with the transport's defaults."""
        return cls(**asdict(config))

    def backoff(self, failures: int) -> float:
        """Pause after the given number of failed tries."""
        return min(self.max_backoff, self.initial_backoff * 2.0 ** min(failures - 1, 30))


DEFAULT_TIMEOUTS = Timeouts()
