"""An error of the operating system as one sentence that says what to do."""

import errno
from collections.abc import Mapping

import zmq

SYSTEM_ERRORS = (OSError, zmq.ZMQError, MemoryError)
"""The errors that the system's refusals raise."""

_REMEDIES: Mapping[int, str] = {
    errno.EACCES: "check its permissions, or name another place",
    errno.EPERM: "check its permissions, or name another place",
    errno.EROFS: "name a writable place",
    errno.ENOENT: "check its name",
    errno.ENOTDIR: "check its name",
    errno.EISDIR: "name a file",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.EILSEQ: "choose another name",
    errno.EINVAL: "check its name",
    errno.ELOOP: "check its symbolic links",
    errno.ENOSPC: "free some space",
    errno.EDQUOT: "free some of your disk quota",
    errno.EBADF: "it was closed before the command began",
    errno.EPIPE: "the program that reads it has ended",
    errno.EFBIG: "see 'ulimit -f'",
    errno.EMFILE: "raise the limit of open files: 'ulimit -n 4096'",
    errno.ENFILE: "the machine has too many files open; stop some processes",
    errno.EAGAIN: "raise the limit of processes ('ulimit -u'), or stop some",
    errno.ENOMEM: "free some memory",
    errno.ENOSYS: "name a place on a local disk",
    errno.ENOLCK: "name a place on a local disk",
    errno.EOPNOTSUPP: "name a place on a local disk",
    errno.EIO: "check whether the disk or terminal is still there",
    errno.ESTALE: "check whether the disk is still mounted",
    errno.ETXTBSY: "wait until no process runs it",
}
_OTHERWISE = "'orchestrator doctor' says what this machine lacks"


def sentence(error: BaseException) -> str:
    """The file, the reason, and what to do: `runs/a: Read-only file system; name a writable place`.

    Args:
        error: one of `SYSTEM_ERRORS`.
    """
    number = getattr(error, "errno", None)
    if isinstance(error, MemoryError):
        number = errno.ENOMEM
    named = getattr(error, "filename", None)
    what = f"{named}: " if named not in (None, "") else ""
    # An error without a number was raised by Python code, whose message is complete.
    remedy = "" if number is None else f"; {_REMEDIES.get(number, _OTHERWISE)}"
    return f"{what}{reason(error)}{remedy}"


def reason(error: BaseException) -> str:
    """The system's own words for the error."""
    if isinstance(error, MemoryError):
        return "no memory is left"
    return str(getattr(error, "strerror", None) or error or type(error).__name__)
