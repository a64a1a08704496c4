"""A client's process, not a worker's: it ends with its client open and a call under way."""

import sys

from protocol import Client
from protocol.messages import Ping, Role

client = Client(sys.argv[1], role=Role.AGENT)
client.submit(Ping())
