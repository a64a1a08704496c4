"""Whether there are file descriptors enough for what is to be opened.

ZeroMQ ends the whole process where it finds none, or waits for ever, depending on which one it lacks. So who is about
to open something with it asks here first.
"""

import os

from protocol.errors import Unavailable

SPARE = 24
"""What opening anything leaves free: a client takes some ten, and others may open something at the same moment."""


def require_descriptors(count: int = SPARE) -> None:
    """Make sure that so many files can be opened.

    Raises:
        Unavailable: they can't; the message tells the limit and how to raise it.
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
