"""Sets the wall clock of a Python process forward by the seconds that a file holds now, as whoever sets it may do."""

import os
import time
from pathlib import Path

_OFFSET = Path(os.environ["CLOCK_OFFSET"])
_now = time.time
time.time = lambda: _now() + float(_OFFSET.read_text() or 0.0)
