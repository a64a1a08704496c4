"""How long anything may take: startup, liveness and progress have a clock each."""

import math

from msgspec import Struct

from protocol.config import TimeoutsConfig
from protocol.errors import InvalidConfig


class Timeouts(Struct, frozen=True, kw_only=True):
    """Seconds.

    Attributes:
        call: bounds one request from send to reply, retries included.
        startup: from the first try to reach a worker until it is ready (imports, shaders, models).
        heartbeat: between two pings to a worker that holds requests.
        liveness: a worker that answered no ping for this long hangs.
        progress: one that answers pings, has work in hand and answered none of it for this long hangs as well.
        grace: how long a process goes on without its orchestrator.
        silence: a connection on which nothing at all was heard for this long is given up and made anew.
        initial_backoff, max_backoff: pause before the second try of a request; it doubles with each further one.
    """

    call: float = 30.0
    startup: float = 120.0
    heartbeat: float = 0.5
    liveness: float = 5.0
    progress: float = 20.0
    grace: float = 60.0
    silence: float = 10.0
    initial_backoff: float = 0.05
    max_backoff: float = 1.0

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            if not 0 < getattr(self, name) < math.inf:
                raise InvalidConfig(f"timeouts.{name} is {getattr(self, name)}; it must be positive and finite")

    @classmethod
    def from_config(cls, config: TimeoutsConfig) -> "Timeouts":
        """The clocks that a run's configuration names."""
        return cls(**{name: getattr(config, name) for name in config.__struct_fields__})

    def backoff(self, failures: int) -> float:
        """Pause after the given number of failed tries."""
        return min(self.max_backoff, self.initial_backoff * 2.0 ** min(failures - 1, 30))


DEFAULT_TIMEOUTS = Timeouts()
