"""Options, examples and the terminal's display and signals, which the commands share."""

import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from orchestrator.hosting.joining import Join, join_of
from orchestrator.monitoring.live_display import Display, open_display
from orchestrator.terminal.console import open_console
from protocol.config import Profile
from protocol.errors import InvalidInput
from protocol.system.stop_request import StopRequest, stop_on_signals
from protocol.telemetry.control import TOKEN_VARIABLE
from protocol.telemetry.endpoint import Endpoint, endpoint_from, parse_endpoint

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout, and nothing else there.")]
HttpOption = Annotated[
    str | None,
    typer.Option(metavar="[HOST:]PORT", help="Where to serve health checks and metrics.", show_default="nowhere"),
]
TokenOption = Annotated[
    Path | None,
    typer.Option(
        "--http-token",
        metavar="FILE",
        help="A file with the token by which callers of --http may end this process.",
        show_default=f"{TOKEN_VARIABLE}'s",
    ),
]
KeyOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="The key of this process, for other machines.", show_default="VANTAGE_KEY's"),
]
AllowedOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="The list of allowed keys.", show_default="allowed.json beside the key"),
]
InsecureOption = Annotated[
    bool,
    typer.Option(
        "--insecure", help="Connect to other machines without keys: any process that can reach this one may use it."
    ),
]
WorkersOption = Annotated[int | None, typer.Option(min=1, help="Perception workers.", show_default="one for each core")]
JoinOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Use the workers of a host, and start none.", show_default="workers are started"
    ),
]

WorkersConfigArgument = Annotated[
    Path | None,
    typer.Argument(metavar="[CONFIG]", help="The configuration of the workers.", show_default="every default"),
]
ProfileOption = Annotated[Profile, typer.Option(help="How people are seen: as the thesis did, or tracked, in metres.")]


def examples(*lines: str) -> str:
    """Example calls of a command, for its help."""
    return "Examples:\n\n" + "\n\n".join(f"  {line}" for line in lines)


def endpoint(http: str | None, token: Path | None) -> Endpoint | None:
    """The endpoint that `--http` and `--http-token` ask for; None without `--http`."""
    return endpoint_from(None if http is None else parse_endpoint(http), token, os.environ)


def worker_count(workers: int | None) -> int:
    """The number of perception workers: `--workers`, or one for each core."""
    return workers or os.cpu_count() or 1


def host_to_join(
    join: str | None, key: Path | None, allowed: Path | None, insecure: bool, workers: int | None = None
) -> Join | None:
    """The host that `--join` asks for, by the keys of the other options; None without it.

    Raises:
        InvalidInput: `--workers` is given with `--join`; or as `join_of`.
        AddressUnavailable: the address is invalid.
    """
    if workers is not None and join is not None:
        raise InvalidInput("--workers sets how many workers to start here; with --join, the host's workers are used")
    return join_of(join, key, allowed, insecure=insecure, environment=os.environ)


@contextmanager
def at_work() -> Generator[tuple[Display, StopRequest]]:
    """Display progress on stderr, and take signals as requests to stop."""
    with stop_on_signals() as stop, open_display(open_console(stderr=True)) as display:
        yield display, stop
