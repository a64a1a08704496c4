"""Where a process answers monitors: a host and a port, and the option that every command line has for it."""

import argparse

from msgspec import Struct

from protocol.errors import InvalidInput

LOOPBACK = "127.0.0.1"
_LARGEST_PORT = 65535


class Endpoint(Struct, frozen=True):
    """A host's name or number and a TCP port; port 0 is one that the system chooses."""

    host: str
    port: int

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine gets there."""
        return self.host in ("localhost", "::1") or self.host.startswith("127.")

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def parse_endpoint(text: str) -> Endpoint:
    """The endpoint that `8000`, `:8000`, `gpu-box:8000` or `[::1]:8000` names; without a host, this machine alone.

    Raises:
        InvalidInput: it names none.
    """
    host, _, port = text.rpartition(":")
    bare = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not (port.isascii() and port.isdecimal()) or int(port) > _LARGEST_PORT or (":" in bare and bare == host):
        raise InvalidInput(f"{text!r} is no place to serve HTTP; write a port or HOST:PORT, such as 8000 or [::1]:8000")
    return Endpoint(bare or LOOPBACK, int(port))


def add_http_option(parser: argparse.ArgumentParser) -> None:
    """Have a command line take `--http`, as an `Endpoint` or None."""
    parser.add_argument(
        "--http",
        type=_argument,
        metavar="[HOST:]PORT",
        help="where to answer health checks and give metrics; without a host, to this machine alone (default: nowhere)",
    )


def _argument(text: str) -> Endpoint:
    try:
        return parse_endpoint(text)
    except InvalidInput as error:
        raise argparse.ArgumentTypeError(str(error)) from error
