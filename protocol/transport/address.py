"""A worker's address: `tcp://host:port` between machines, `ipc:///path/of/a/socket` within one."""

import contextlib
import errno
import re
import socket
from pathlib import Path

from protocol.errors import AddressUnavailable

LONGEST_IPC_PATH = 103
"""Bytes that every system takes: macOS 103, Linux 107."""

_TCP = re.compile(r"tcp://(?P<host>\[[0-9A-Fa-f:.%]+\]|[A-Za-z0-9._*-]+):(?P<port>\d{1,5}|\*)")


_EVERY_INTERFACE = re.compile(r"tcp://(?:\*|0\.0\.0\.0|\[::\]):(?P<port>\d{1,5})")


def check_address(address: str) -> str:
    """Return `address` if it is well formed.

    Raises:
        AddressUnavailable: it is not, or its socket's path is longer than the system takes.
    """
    path = ipc_path(address)
    if path is not None:
        _check_path(address, path)
    else:
        _check_tcp(address)
    return address


def ipc_path(address: str) -> Path | None:
    """The socket's file for an `ipc://` address; None for any other."""
    return Path(address.removeprefix("ipc://")) if address.startswith("ipc://") else None


def host_of(address: str) -> str:
    """The host name or IP address in a `tcp://` address; empty for any other."""
    match = _TCP.fullmatch(address)
    return "" if match is None else match["host"].strip("[]")


def reachable(bind: str, host: str) -> str:
    """The address at which other machines reach a socket: `host` in place of a bind to every interface."""
    match = _EVERY_INTERFACE.fullmatch(bind)
    return bind if match is None else f"tcp://{host}:{match['port']}"


def clear_stale_socket(address: str) -> None:
    """Remove the file that a killed worker left at an ipc address.

    ZeroMQ itself would take over the file of a running worker, so that two workers would serve one address.

    Raises:
        AddressUnavailable: a process listens there, or a file that is not a socket has this name.
    """
    path = ipc_path(address)
    if path is None or not path.exists():
        return
    if not path.is_socket():
        raise AddressUnavailable(f"{address} can't be served: {path} is a file, not a socket")
    if _answers(path):
        raise AddressUnavailable(f"{address} is in use; stop the worker there or choose another address")
    path.unlink(missing_ok=True)


def _answers(path: Path) -> bool:
    with contextlib.closing(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)) as probe:
        refused = probe.connect_ex(str(path))
    return refused not in (errno.ECONNREFUSED, errno.ENOENT)


def _check_path(address: str, path: Path) -> None:
    if not path.name:
        raise AddressUnavailable(f"{address} names no socket; write ipc:///path/of/the/socket")
    length = len(bytes(path))
    if length > LONGEST_IPC_PATH:
        raise AddressUnavailable(
            f"{address} has a path of {length} bytes, the system takes {LONGEST_IPC_PATH}; choose a shorter directory"
        )


def _check_tcp(address: str) -> None:
    match = _TCP.fullmatch(address)
    if match is None or (match["port"] != "*" and not 0 < int(match["port"]) < 65536):
        raise AddressUnavailable(f"{address!r} is not an address; write tcp://host:port or ipc:///path/of/a/socket")
