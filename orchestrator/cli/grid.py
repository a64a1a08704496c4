"""`orchestrator experiment grid`: exploration on a grid of views around people."""

from pathlib import Path
from typing import Annotated

import typer

from orchestrator.cli.observation import complete, require_libraries, worker_settings
from orchestrator.cli.options import (
    AllowedOption,
    InsecureOption,
    JoinOption,
    JsonOption,
    KeyOption,
    ProfileOption,
    WorkersConfigArgument,
    WorkersOption,
    at_work,
    examples,
    host_to_join,
    worker_count,
)
from orchestrator.run.versions import collect_versions
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT
from orchestrator.terminal.command_group import FAILED
from orchestrator.terminal.output import print_json, print_line
from protocol.grid.table import read_stored_table

grid_app = typer.Typer(help="Exploration: where to look, on a grid of views around people.", no_args_is_help=True)

TRAIN, TEST = 80, 40


@grid_app.command(
    "build",
    epilog=examples(
        "orchestrator experiment grid build --profile thesis",
        "orchestrator experiment grid build --profile vantage --train 240 --out runs/experiments/large-grid",
    ),
)
def build(
    config: WorkersConfigArgument = None,
    profile: ProfileOption = "vantage",
    train: Annotated[int, typer.Option(min=1, help="Environments to train on.")] = TRAIN,
    test: Annotated[int, typer.Option(min=1, help="Environments to test on.")] = TEST,
    seed: Annotated[int, typer.Option(min=0, help="Of the environments.")] = 0,
    workers: WorkersOption = None,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="The directory.", show_default="runs/experiments/grid-PROFILE"),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Observe people from each cell of a grid around them, and make the table that `vantage/Grid-v0` walks on.

    After a stop or a kill, the same command continues with the first missing environment.
    """
    require_libraries()
    from orchestrator.experiments.grid.directory import GridDirectory, default_path
    from orchestrator.experiments.grid.observing import observe_parts
    from orchestrator.experiments.grid.storing import store
    from orchestrator.experiments.grid.summary import summary_of
    from orchestrator.experiments.grid.views import GridViews

    host = host_to_join(join, key, allowed, insecure, workers)
    settings = worker_settings(config, workers, host, profile=profile)
    views = GridViews(train=train, test=test, seed=seed)
    directory = GridDirectory.open_for(out or default_path(profile), settings, views)
    parts = directory.parts()
    complete(directory, parts, settings, host, lambda pools: observe_parts(parts, views, settings, pools))
    store(directory)
    summary = summary_of(directory.table_path)
    if json:
        print_json(summary)
    else:
        print_line(summary.words)


@grid_app.command(
    "check",
    epilog=examples(
        "orchestrator experiment grid check runs/experiments/grid-thesis/grid.msgpack",
        "orchestrator experiment grid check grid.msgpack --environments 10",
    ),
)
def check(
    table: Annotated[Path, typer.Argument(metavar="FILE", help="A table.", show_default=False)],
    environments: Annotated[int, typer.Option(min=1, help="How many to build again.")] = 2,
    workers: WorkersOption = None,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    json: JsonOption = False,
) -> None:
    """Build some environments of a table again by its recipe, and compare their bytes; fails if any differs."""
    require_libraries()
    from orchestrator.experiments.grid import checking
    from orchestrator.experiments.grid.observing import GridObserver
    from orchestrator.experiments.grid.views import OBSERVED_CELLS
    from orchestrator.experiments.workers import Rate, experiment_workers, with_workers

    stored = read_stored_table(table)
    told, views = checking.settings_of(stored, table)
    host = host_to_join(join, key, allowed, insecure, workers)
    settings = with_workers(told, worker_count(workers))
    numbers = checking.spread_over(len(stored.places), environments)
    with at_work() as (display, stop), experiment_workers(settings, host, display=display, stop=stop) as pools:
        checking.require_alike(stored.recipe, pools.capabilities())
        observer = GridObserver(views, settings, pools, Rate(len(numbers) * len(OBSERVED_CELLS)))
        rebuilt = tuple(checking.compared(stored, numbers, observer.observe(numbers)))
    packages = checking.differences(stored.recipe.packages, collect_versions(PROCESS_ENVIRONMENT).packages)
    result = checking.TableCheck(table=str(table), environments=rebuilt, packages=packages)
    if json:
        print_json(result)
    else:
        print_line(result.words)
    if not result.same:
        raise typer.Exit(FAILED)
