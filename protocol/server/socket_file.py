"""The file of a worker's `ipc://` socket: there for as long as it serves, whoever removes it meanwhile.

Cleaners of temporary directories remove what nobody has touched for days, which in a run of weeks are its sockets. Who
is connected notices nothing; but nobody can connect any more.
"""

import logging
import stat
from collections.abc import Callable
from pathlib import Path

import zmq

from protocol.transport.address import ipc_path
from protocol.transport.sockets import Socket

LOOK_EVERY = 1.0
"""Seconds between two looks whether the file is there."""

_log = logging.getLogger(__name__)


class SocketFile:
    """Puts a socket's file back where it is missing. To be used by whoever uses the socket.

    Args:
        router: it is bound; if to no file of its own, nothing is ever to be done.
    """

    def __init__(self, router: Socket, clock: Callable[[], float]) -> None:
        self._router = router
        self._clock = clock
        self._due = clock() + LOOK_EVERY
        self._failed = False
        path = ipc_path(router.get_string(zmq.LAST_ENDPOINT))
        self._path = path if path is not None and path.exists() else None
        self._home = self._path.parent.lstat() if self._path is not None else None

    @property
    def patience_ms(self) -> int | None:
        """For how long the socket may be waited for until the next look; None for ever."""
        return None if self._path is None else round(LOOK_EVERY * 1000)

    def keep(self) -> None:
        """Look whether it is time to, and have the socket serve at its file again if that is gone."""
        if self._path is None or self._clock() < self._due:
            return
        self._due = self._clock() + LOOK_EVERY
        if not self._path.exists():
            self._put_back(self._path)

    def _put_back(self, path: Path) -> None:
        try:
            self._make_home(path.parent)
            # The file that is gone stays bound as well: to let go of it would, a moment later, remove the new one.
            self._router.bind(f"ipc://{path}")
        except (OSError, zmq.ZMQError) as error:
            if not self._failed:
                _log.warning("%s was removed and can't be put back, so that nobody can connect: %s", path, error)
            self._failed = True
        else:
            _log.warning("%s was removed, and is there again", path)
            self._failed = False

    def _make_home(self, directory: Path) -> None:
        """Make the socket's directory again as it was.

        Raises:
            OSError: the system would not, or somebody else was first, where everybody may write.
        """
        if self._home is None:
            return
        directory.mkdir(mode=stat.S_IMODE(self._home.st_mode), exist_ok=True)
        found = directory.lstat()
        opened = stat.S_IMODE(found.st_mode) & ~stat.S_IMODE(self._home.st_mode)
        if found.st_uid != self._home.st_uid or not stat.S_ISDIR(found.st_mode) or opened:
            raise PermissionError(f"{directory} is not the directory that it was")
