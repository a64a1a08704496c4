"""Whether enough file descriptors are free.

Without a free one ZeroMQ aborts the process or waits for ever, depending on what it opens. So check here before opening
anything with it.
"""

import os

from protocol.errors import Unavailable

SPARE = 24
"""Descriptors that have to be free: a client takes some ten, and other threads may open files at the same moment."""


def require_descriptors(count: int = SPARE) -> None:
    """Make sure that the process can open `count` more files.

    Raises:
        Unavailable: it can't; the message says how to raise the limit.
    """
    opened: list[int] = []
    try:
        opened.append(os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC))
        opened.extend(os.dup(opened[0]) for _ in range(count - 1))
    except OSError as error:
        raise Unavailable(
            f"this process can open no more files and sockets ({error.strerror}); raise the limit by 'ulimit -n 4096' "
            "in the shell that starts it, or LimitNOFILE= where systemd does"
        ) from error
    finally:
        for descriptor in opened:
            os.close(descriptor)
