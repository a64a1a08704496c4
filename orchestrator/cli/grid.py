"""`orchestrator experiment grid`: exploration on a grid of views around people."""

import os
from pathlib import Path
from typing import Annotated

import typer
from msgspec.structs import replace

from orchestrator.cli.observation import complete, require_libraries
from orchestrator.cli.options import (
    AllowedOption,
    InsecureOption,
    JoinOption,
    JsonOption,
    KeyOption,
    WorkersOption,
    examples,
    worker_count,
)
from orchestrator.hosting.joining import join_of
from orchestrator.terminal.output import print_json, print_line
from protocol.config import Profile, RunConfig
from protocol.config_file import load_config, with_checksums

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
    config: Annotated[
        Path | None,
        typer.Argument(metavar="[CONFIG]", help="The configuration of the workers.", show_default="every default"),
    ] = None,
    profile: Annotated[
        Profile, typer.Option(help="How people are seen: as the thesis did, or tracked, in metres.")
    ] = "vantage",
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
    from orchestrator.experiments.workers import with_workers

    count = worker_count(workers, join)
    host = join_of(join, key, allowed, insecure=insecure, environment=os.environ)
    told = replace(load_config(config) if config else RunConfig(), profile=profile)
    settings = with_workers(told if host else with_checksums(told), count)
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
