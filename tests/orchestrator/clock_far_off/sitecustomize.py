"""Has a Python process believe it is ten years later where PYTHONPATH names this folder, since Python imports it."""

import time

_TEN_YEARS = 10 * 365 * 86400.0
_now = time.time
time.time = lambda: _now() + _TEN_YEARS
