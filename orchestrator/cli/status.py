"""`orchestrator status`: the state of a run, by its files or by its processes' HTTP endpoints."""

from pathlib import Path
from typing import Annotated

import typer

from orchestrator.cli.options import JsonOption, examples
from orchestrator.monitoring.status import RunStatus, run_status, status_view
from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.runs import newest_run
from orchestrator.terminal.command_group import FAILED
from orchestrator.terminal.output import print_json, show
from protocol.errors import InvalidInput
from protocol.telemetry.endpoint import parse_endpoint

status_app = typer.Typer()


@status_app.command(
    epilog=examples(
        "orchestrator status",
        "orchestrator status runs/monday --json",
        "orchestrator status --http gpu-box:8000 --http jetson:8000",
    )
)
def status(
    run: Annotated[
        Path | None, typer.Argument(metavar="[RUN]", help="A run directory.", show_default="the newest in runs/")
    ] = None,
    http: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[HOST:]PORT", help="Ask the process at this endpoint instead; may be given more than once."
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Show the state of a run: the agent's progress, and the state of each worker.

    With --http, processes on any machine are asked at their own --http endpoints; exits with 1 if one is not ready.
    """
    if http:
        if run is not None:
            raise InvalidInput("give a run on this machine or --http, not both")
        _print_reports(http, json)
    else:
        _print_status(run_status(RunDirectory.open(run) if run else newest_run()), json)


def _print_status(found: RunStatus, json: bool) -> None:
    if json:
        print_json(found)
    else:
        show(status_view(found))


def _print_reports(places: list[str], json: bool) -> None:
    # No other command needs httpx.
    from orchestrator.monitoring.process_report import process_reports, reports_table

    reports = process_reports([parse_endpoint(place) for place in places])
    if json:
        print_json(reports)
    else:
        show(reports_table(reports))
    if not all(report.ready for report in reports):
        raise typer.Exit(FAILED)
