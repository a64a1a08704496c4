"""When to replace a worker: at a limit of memory or of answered requests."""

from protocol.config import SupervisionConfig
from protocol.messages import Pong


def reason_to_recycle(pong: Pong | None, config: SupervisionConfig) -> str | None:
    """Why to replace a worker, as words to follow its name; None where it may go on.

    Args:
        pong: its last answer; None before the first.
    """
    # A limit below the memory of a fresh worker must not stop all work: each worker answers at least one request.
    if pong is None or pong.progress == 0:
        return None
    if config.recycle_bytes and pong.resident_bytes > config.recycle_bytes:
        return f"takes {pong.resident_bytes / 2**20:.0f} MiB, more than {config.recycle_bytes / 2**20:.0f}"
    if config.recycle_requests and pong.progress >= config.recycle_requests:
        return f"has answered {pong.progress} requests"
    return None
