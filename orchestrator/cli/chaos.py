"""`orchestrator chaos`: a training under faults, compared with one without."""

from pathlib import Path
from typing import Annotated

import typer

from orchestrator.cli.options import JsonOption, at_work, examples
from orchestrator.terminal.command_group import FAILED
from orchestrator.terminal.output import print_json, show
from protocol.config_file import load_config

chaos_app = typer.Typer()


@chaos_app.command(
    epilog=examples(
        "orchestrator chaos configs/quickstart.toml --faults 20 --seed 7",
        "orchestrator chaos configs/quickstart.toml --faults 5 --only kill-agent --only stop-render",
    )
)
def chaos(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="A configuration file (TOML).", show_default=False)],
    faults: Annotated[int, typer.Option(min=1, help="How many faults; from 20 on, each class occurs.")] = 20,
    seed: Annotated[int, typer.Option(help="Of the random schedule of faults.")] = 0,
    only: Annotated[
        list[str] | None, typer.Option(help="A fault class; may be given more than once.", show_default="all")
    ] = None,
    runs: Annotated[Path, typer.Option(help="The directory for the runs.")] = Path("runs/chaos"),
    json: JsonOption = False,
) -> None:
    """Train once without faults and once under faults, and compare weights, episodes and replay byte for byte."""
    from orchestrator.chaos import rehearsal, report
    from orchestrator.chaos.scenarios import catalogue

    scenarios = catalogue.chosen(tuple(only or ()), workers=not load_config(config).is_grid)
    order = rehearsal.Order(config=config, faults=faults, seed=seed, scenarios=scenarios, runs=runs)
    with at_work() as (display, stop):
        found = rehearsal.rehearse(order, display, stop)
    if json:
        print_json(found)
    else:
        show(report.report_view(found))
    if not found.passed:
        raise typer.Exit(FAILED)
