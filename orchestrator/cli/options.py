"""What the commands have in common: options, examples, and how they work with a person before them."""

import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from orchestrator.monitoring.live_display import Display, open_display
from orchestrator.terminal.console import open_console
from protocol.errors import InvalidInput
from protocol.system.stop_request import StopRequest, stop_on_signals
from protocol.telemetry.control import TOKEN_VARIABLE
from protocol.telemetry.endpoint import Endpoint, endpoint_from, parse_endpoint

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout, and nothing else there.")]
HttpOption = Annotated[
    str | None,
    typer.Option(metavar="[HOST:]PORT", help="Where to answer health checks and give metrics.", show_default="nowhere"),
]
TokenOption = Annotated[
    Path | None,
    typer.Option(
        "--http-token",
        metavar="FILE",
        help="Whose content lets callers of --http end this process.",
        show_default=f"{TOKEN_VARIABLE}'s",
    ),
]
KeyOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="This process' key, to speak between machines.", show_default="VANTAGE_KEY's"),
]
AllowedOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="The list of allowed keys.", show_default="allowed.json beside the key"),
]
InsecureOption = Annotated[
    bool, typer.Option("--insecure", help="Speak between machines without keys: whoever reaches us may use us.")
]

JoinOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Work with the workers of a host, and start none.", show_default="workers are started"
    ),
]


def examples(*lines: str) -> str:
    """How a command is called, for its help."""
    return "Examples:\n\n" + "\n\n".join(f"  {line}" for line in lines)


def endpoint(http: str | None, token: Path | None) -> Endpoint | None:
    """What the options `--http` and `--http-token` come to."""
    return endpoint_from(None if http is None else parse_endpoint(http), token, os.environ)


def worker_count(workers: int | None, join: str | None) -> int:
    """How many perception workers `--workers` comes to: one for each core where it is left out.

    Raises:
        InvalidInput: it is given, and the workers are those of a host.
    """
    if workers is not None and join is not None:
        raise InvalidInput("--workers are those that are started here; with --join the host's do the work")
    return workers or os.cpu_count() or 1


@contextmanager
def at_work() -> Generator[tuple[Display, StopRequest]]:
    """Show progress on stderr, and take signals as requests to stop."""
    with stop_on_signals() as stop, open_display(open_console(stderr=True)) as display:
        yield display, stop
