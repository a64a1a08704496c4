"""The HTTP endpoint of a process, and the command line's options for it."""

import argparse
from collections.abc import Mapping
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from protocol.errors import InvalidInput
from protocol.telemetry.control import TOKEN_VARIABLE, token_from

LOOPBACK = "127.0.0.1"
_LARGEST_PORT = 65535


class Endpoint(Struct, frozen=True):
    """A host name or IP address, and a TCP port.

    Attributes:
        port: 0 for a port that the system chooses.
        token: that control calls have to send; empty without control calls. It is never printed.
    """

    host: str
    port: int
    token: str = ""

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach it."""
        return self.host in ("localhost", "::1") or self.host.startswith("127.")

    def __repr__(self) -> str:
        return f"Endpoint({str(self)!r})"

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def parse_endpoint(text: str) -> Endpoint:
    """The endpoint that `8000`, `:8000`, `gpu-box:8000` or `[::1]:8000` names; without a host, the loopback.

    Raises:
        InvalidInput: the text names no endpoint.
    """
    host, _, port = text.rpartition(":")
    bare = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not (port.isascii() and port.isdecimal()) or int(port) > _LARGEST_PORT or (":" in bare and bare == host):
        raise InvalidInput(f"{text!r} is not an HTTP endpoint; write a port or HOST:PORT, such as 8000 or [::1]:8000")
    return Endpoint(bare or LOOPBACK, int(port))


def add_http_options(parser: argparse.ArgumentParser) -> None:
    """Add `--http` and `--http-token`."""
    parser.add_argument(
        "--http",
        type=_argument,
        metavar="[HOST:]PORT",
        help="where to answer health checks and give metrics; without a host, to this machine alone (default: nowhere)",
    )
    parser.add_argument(
        "--http-token",
        type=Path,
        metavar="FILE",
        help=f"whose content lets a caller of --http end this process (default: what {TOKEN_VARIABLE} names, or none)",
    )


def endpoint_of(options: argparse.Namespace, environment: Mapping[str, str]) -> Endpoint | None:
    """The endpoint that the options name; None without `--http`.

    Raises:
        InvalidInput: a token without an endpoint.
        NotPermitted: see `token_from`.
    """
    return endpoint_from(options.http, options.http_token, environment)


def endpoint_from(at: Endpoint | None, token: Path | None, environment: Mapping[str, str]) -> Endpoint | None:
    """The same as `endpoint_of`, from the options' values."""
    if at is None:
        if token is not None:
            raise InvalidInput("--http-token lets callers of --http end this process; it needs --http")
        return None
    return replace(at, token=token_from(token, environment))


def _argument(text: str) -> Endpoint:
    try:
        return parse_endpoint(text)
    except InvalidInput as error:
        raise argparse.ArgumentTypeError(str(error)) from error
