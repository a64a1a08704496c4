"""What all processes of Vantage share: messages and their types, clients and servers, configuration and errors."""

from protocol.client.client import Client
from protocol.client.dispatcher import Statistics
from protocol.client.pending import Pending, Timing
from protocol.client.pool import Pool
from protocol.limits import Limits
from protocol.server.server import Handlers, serve
from protocol.timeouts import Timeouts

__all__ = ["Client", "Handlers", "Limits", "Pending", "Pool", "Statistics", "Timeouts", "Timing", "serve"]
