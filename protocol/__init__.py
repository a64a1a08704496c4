"""The language that all of Vantage's processes speak: messages, the types in them, and how they travel."""

from protocol.client import Client
from protocol.dispatcher import Statistics
from protocol.limits import Limits
from protocol.pending import Pending, Timing
from protocol.pool import Pool
from protocol.server import Handlers, serve
from protocol.timeouts import Timeouts

__all__ = ["Client", "Handlers", "Limits", "Pending", "Pool", "Statistics", "Timeouts", "Timing", "serve"]
