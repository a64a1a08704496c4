"""When a worker has grown or worked enough and is to be replaced."""

from protocol.config import SupervisionConfig
from protocol.messages import Pong


def reason_to_recycle(pong: Pong | None, config: SupervisionConfig) -> str | None:
    """Why, to follow the worker's name; None where it may go on.

    Args:
        pong: its last answer; None before the first.
    """
    # A limit below what a fresh worker takes must not end all work: each one answers something.
    if pong is None or pong.progress == 0:
        return None
    if config.recycle_bytes and pong.resident_bytes > config.recycle_bytes:
        return f"takes {pong.resident_bytes / 2**20:.0f} MiB, more than {config.recycle_bytes / 2**20:.0f}"
    if config.recycle_requests and pong.progress >= config.recycle_requests:
        return f"has answered {pong.progress} requests"
    return None
