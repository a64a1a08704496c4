"""The language that all of Vantage's processes speak: messages, the types in them, and how they travel."""

from protocol.client.client import Client
from protocol.client.dispatcher import Statistics
from protocol.client.pending import Pending, Timing
from protocol.client.pool import Pool
from protocol.limits import Limits
from protocol.server.server import Handlers, serve
from protocol.timeouts import Timeouts

__all__ = ["Client", "Handlers", "Limits", "Pending", "Pool", "Statistics", "Timeouts", "Timing", "serve"]
