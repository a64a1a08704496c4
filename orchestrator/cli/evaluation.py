"""`orchestrator evaluate`: a trained policy and the baselines over the same test scenes."""

from pathlib import Path
from typing import Annotated

import typer

from orchestrator import training
from orchestrator.cli.options import JsonOption, at_work, examples
from orchestrator.errors import RunError
from orchestrator.monitoring.table import evaluation_table
from orchestrator.run.run_directory import RunDirectory
from orchestrator.supervision.launch import Evaluate
from orchestrator.terminal.output import print_json, show

evaluation_app = typer.Typer()


@evaluation_app.command(
    epilog=examples(
        "orchestrator evaluate runs/monday",
        "orchestrator evaluate runs/monday --episodes 100 --policy trained --policy random",
    )
)
def evaluate(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="A run directory whose training has ended.", show_default=False)
    ],
    episodes: Annotated[
        int | None, typer.Option(min=1, help="Flights of each policy.", show_default="as configured")
    ] = None,
    policy: Annotated[
        list[str] | None, typer.Option(help="A policy to fly; may be given more than once.", show_default="all")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Fly a trained policy and the baselines over the same test scenes, and print how each did."""
    directory = RunDirectory.open(run)
    config = directory.verified_config()
    with at_work() as (display, stop):
        what = Evaluate(episodes=episodes, policies=tuple(policy or ()))
        training.evaluate(directory, config, what, display=display, stop=stop)
    evaluation = directory.evaluation()
    if evaluation is None:
        raise RunError(f"the agent left no whole {directory.evaluation_path}")
    if json:
        print_json(evaluation)
    else:
        show(evaluation_table(evaluation))
