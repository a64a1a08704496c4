"""`orchestrator calibration`: uncertainty in metres, fitted and shown by the perception worker's own command."""

from pathlib import Path
from typing import Annotated

import typer

from orchestrator.cli.options import examples
from orchestrator.cli.setup_command import run_setup
from protocol.system.stop_request import stop_on_signals

calibration_app = typer.Typer(
    help="Uncertainty in metres: what a joint's error is expected to be, and a radius that holds it.",
    no_args_is_help=True,
)


@calibration_app.command(
    "fit", epilog=examples("orchestrator calibration fit runs/experiments/train/qoe.parquet mine.msgpack")
)
def fit(
    table: Annotated[Path, typer.Argument(metavar="TABLE", help="Of 'orchestrator experiment qoe --split train'.")],
    output: Annotated[Path, typer.Argument(metavar="FILE", help="Where to put the calibration.")],
) -> None:
    """Fit a calibration to a table of people whose truth is known; `perception.calibration` selects it."""
    _run("fit", str(table), "--output", str(output))


@calibration_app.command("show", epilog=examples("orchestrator calibration show"))
def show(
    file: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="A calibration.", show_default="those that are shipped")
    ] = None,
) -> None:
    """Tell what a calibration is for, and where it comes from."""
    _run("show", *([] if file is None else [str(file)]))


def _run(*arguments: str) -> None:
    with stop_on_signals() as stop:
        code = run_setup("perception_worker.calibration", *arguments, stop=stop)
    raise typer.Exit(code)
