"""What the operating system refuses, as one sentence that says what to do."""

import errno
from collections.abc import Mapping

import zmq

SYSTEM_ERRORS = (OSError, zmq.ZMQError, MemoryError)
"""What is raised where the system refuses something."""

_REMEDIES: Mapping[int, str] = {
    errno.EACCES: "see who may do so, or name another place",
    errno.EPERM: "see who may do so, or name another place",
    errno.EROFS: "name a place that can be written to",
    errno.ENOENT: "see whether its name is right",
    errno.ENOTDIR: "see whether its name is right",
    errno.EISDIR: "name a file",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.EILSEQ: "choose another name",
    errno.EINVAL: "see whether its name is right",
    errno.ELOOP: "see where its links lead",
    errno.ENOSPC: "free some space",
    errno.EDQUOT: "free some of your share of the disk",
    errno.EBADF: "it was closed before we began",
    errno.EPIPE: "whoever was to read it has ended",
    errno.EFBIG: "see 'ulimit -f'",
    errno.EMFILE: "let a process have more files open: 'ulimit -n 4096'",
    errno.ENFILE: "the whole machine has too many files open; end who has them",
    errno.EAGAIN: "let a user have more processes ('ulimit -u'), or end some",
    errno.ENOMEM: "free some memory",
    errno.ENOSYS: "name a place on a local disk",
    errno.ENOLCK: "name a place on a local disk",
    errno.EOPNOTSUPP: "name a place on a local disk",
    errno.EIO: "see whether the disk or terminal is still there",
    errno.ESTALE: "see whether the disk is still mounted",
    errno.ETXTBSY: "wait until nobody runs it",
}
_OTHERWISE = "'orchestrator doctor' says what this machine lacks"


def sentence(error: BaseException) -> str:
    """What was refused, of what, and what to do: `runs/a: Read-only file system; name a place that can be written to`.

    Args:
        error: one of `SYSTEM_ERRORS`.
    """
    number = getattr(error, "errno", None)
    if isinstance(error, MemoryError):
        number = errno.ENOMEM
    named = getattr(error, "filename", None)
    what = f"{named}: " if named not in (None, "") else ""
    # One without a number was raised by somebody who has said all in its message.
    remedy = "" if number is None else f"; {_REMEDIES.get(number, _OTHERWISE)}"
    return f"{what}{reason(error)}{remedy}"


def reason(error: BaseException) -> str:
    """The system's own word for what it refused."""
    if isinstance(error, MemoryError):
        return "no memory is left"
    return str(getattr(error, "strerror", None) or error or type(error).__name__)
