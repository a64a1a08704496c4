"""The file of a worker's `ipc://` socket, which is restored if it is removed while the worker serves.

Programs that clean temporary directories remove files untouched for days, such as the sockets of a run of weeks.
Existing connections go on working without the file, but no client can connect any more.
"""

import logging
import stat
from collections.abc import Callable
from pathlib import Path

import zmq

from protocol.transport.address import ipc_path
from protocol.transport.sockets import Socket

CHECK_EVERY = 1.0
"""Seconds between two checks whether the file exists."""

_log = logging.getLogger(__name__)


class SocketFile:
    """Restores a socket's file when it is missing. Belongs to the thread that uses the socket.

    Args:
        router: a bound socket; if it is not bound to a file, nothing is done.
    """

    def __init__(self, router: Socket, clock: Callable[[], float]) -> None:
        self._router = router
        self._clock = clock
        self._due = clock() + CHECK_EVERY
        self._failed = False
        path = ipc_path(router.get_string(zmq.LAST_ENDPOINT))
        self._path = path if path is not None and path.exists() else None
        self._directory = self._path.parent.lstat() if self._path is not None else None

    @property
    def timeout_ms(self) -> int | None:
        """Milliseconds that a poll of the socket may take until the next check; None for no limit."""
        return None if self._path is None else round(CHECK_EVERY * 1000)

    def restore_if_missing(self) -> None:
        """If a check is due and the file is missing, bind the socket to it again."""
        if self._path is None or self._clock() < self._due:
            return
        self._due = self._clock() + CHECK_EVERY
        if not self._path.exists():
            self._restore(self._path)

    def _restore(self, path: Path) -> None:
        try:
            self._make_directory(path.parent)
            # The socket also stays bound to the removed file: to unbind it would, a moment later, remove the new file.
            self._router.bind(f"ipc://{path}")
        except (OSError, zmq.ZMQError) as error:
            if not self._failed:
                _log.warning("%s was removed and can't be restored, so no client can connect: %s", path, error)
            self._failed = True
        else:
            _log.warning("%s was removed; it is restored", path)
            self._failed = False

    def _make_directory(self, directory: Path) -> None:
        """Make the socket's directory again, with the same mode.

        Raises:
            OSError: the system refuses it, or another user made a directory or file of this name first.
        """
        if self._directory is None:
            return
        directory.mkdir(mode=stat.S_IMODE(self._directory.st_mode), exist_ok=True)
        found = directory.lstat()
        opened = stat.S_IMODE(found.st_mode) & ~stat.S_IMODE(self._directory.st_mode)
        if found.st_uid != self._directory.st_uid or not stat.S_ISDIR(found.st_mode) or opened:
            raise PermissionError(f"{directory} is not the directory that it was")
