"""Gets ready at once, and knows no request."""

import sys

from protocol import serve
from protocol.messages import Role

serve(dict, role=Role.RENDER, bind=sys.argv[1])
