"""`orchestrator host`: where workers and runs on several machines find each other."""

import os
from typing import Annotated

import typer

from orchestrator.cli.options import (
    AllowedOption,
    HttpOption,
    InsecureOption,
    KeyOption,
    TokenOption,
    endpoint,
    examples,
)
from orchestrator.hosting.host import HostOrder
from orchestrator.hosting.host import host as serve_host
from orchestrator.hosting.host_display import open_host_display
from orchestrator.monitoring.telemetry import host_telemetry
from orchestrator.terminal.console import open_console
from protocol.security.options import security_from
from protocol.system.stop_request import stop_on_signals

host_app = typer.Typer()


@host_app.command(
    epilog=examples(
        "orchestrator host --key hub.key",
        "orchestrator host --bind tcp://127.0.0.1:5600 --http 8000 --stay",
    )
)
def host(
    bind: Annotated[str, typer.Option(metavar="ADDRESS", help="Where to serve.")] = "tcp://0.0.0.0:5600",
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    http: HttpOption = None,
    http_token: TokenOption = None,
    stay: Annotated[bool, typer.Option("--stay", help="Go on when the runs are done, with the workers.")] = False,
) -> None:
    """Be where workers and runs on several machines find each other; start nothing.

    Workers register with '--orchestrator ADDRESS', runs join by 'orchestrator train --join ADDRESS'. Once a run is done
    and no other is under way, the workers end, and then this. Killed and started again, it is found again by all.
    """
    security = security_from(key, allowed, insecure=insecure, environment=os.environ)
    order = HostOrder(bind=bind, stay=stay, security=security)
    with (
        stop_on_signals() as stop,
        open_host_display(open_console(stderr=True)) as display,
        host_telemetry(endpoint(http, http_token), bind, display) as monitors,
    ):
        serve_host(order, display=monitors.display, stop=stop, observer=monitors.registry)
