"""`orchestrator lifter`: renders what a lifter learns from, and has the perception worker's own command fit it."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from orchestrator.cli.options import (
    AllowedOption,
    InsecureOption,
    JoinOption,
    KeyOption,
    at_work,
    examples,
    worker_count,
)
from orchestrator.cli.setup_command import run_setup
from orchestrator.hosting.joining import Join, join_of
from orchestrator.run.versions import collect_versions
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT
from protocol.config import RunConfig
from protocol.config_file import load_config, with_checksums
from protocol.errors import VantageError
from protocol.system.stop_request import stop_on_signals

if TYPE_CHECKING:
    from orchestrator.lifter.directory import FitDirectory

_MODULE = "perception_worker.lifter"

lifter_app = typer.Typer(
    help="A lifter that has learned where a body's joints are, and how far off each may be.", no_args_is_help=True
)


@lifter_app.command(
    "fit",
    epilog=examples(
        "orchestrator lifter fit",
        "orchestrator lifter fit --frames 4000 --epochs 20 --out runs/small-lifter",
    ),
)
def fit(
    config: Annotated[
        Path | None, typer.Argument(metavar="[CONFIG]", help="Of the workers.", show_default="every default")
    ] = None,
    frames: Annotated[int, typer.Option(min=1, help="How many views it learns from.")] = 60000,
    seed: Annotated[int, typer.Option(min=0, help="Of the views, and of what is drawn in training.")] = 0,
    wide: Annotated[
        float,
        typer.Option(min=0, max=1, help="Share of the scenes in poses of the widest ranges, not the eight kinds'."),
    ] = 0.65,
    epochs: Annotated[int, typer.Option(min=1, help="How often it sees each view.")] = 40,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Perception workers.", show_default="one for each core")
    ] = None,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Where it goes.", show_default="runs/lifter")] = None,
) -> None:
    """Render views of train identities, and fit a lifter on them; `perception.lifter` selects it.

    Stopped or killed, the same command goes on where it was: with the next part of its views, or the next epoch of its
    training.
    """
    from orchestrator.experiments.workers import with_workers
    from orchestrator.lifter.directory import DEFAULT_PATH, FitDirectory
    from orchestrator.lifter.views import FitViews

    count = worker_count(workers, join)
    host = join_of(join, key, allowed, insecure=insecure, environment=os.environ)
    told = load_config(config) if config else RunConfig()
    settings = with_workers(told if host else with_checksums(told), count)
    views = FitViews(frames=frames, seed=seed, wide=wide)
    directory = FitDirectory.open_for(out or DEFAULT_PATH, settings, views)
    _observe(directory, settings, host)
    _run("fit", str(directory.table_path), "--output", str(directory.lifter_path), *_training(epochs, seed))


@lifter_app.command(
    "show", epilog=examples("orchestrator lifter show", "orchestrator lifter show runs/lifter/lifter.msgpack")
)
def show(
    file: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="A lifter.", show_default="those that are shipped")
    ] = None,
) -> None:
    """Tell what a lifter is for, where it comes from, and how sure it is."""
    _run("show", *([] if file is None else [str(file)]))


def _observe(directory: "FitDirectory", settings: RunConfig, host: Join | None) -> None:
    """Have the parts of the table made that are missing, and the table of them."""
    from orchestrator.experiments.qoe import provenance
    from orchestrator.experiments.workers import experiment_workers
    from orchestrator.lifter.observing import observe_fit_views

    parts = directory.parts()
    with directory.lock(), at_work() as (display, stop):
        if parts.is_whole:
            return
        try:
            with experiment_workers(settings, host, display=display, stop=stop) as workers:
                observe_fit_views(parts, directory.views(), settings.environment, workers)
                versions = collect_versions(PROCESS_ENVIRONMENT)
                parts.join(provenance(settings, directory.views(), versions, workers.capabilities()))
        except VantageError as error:
            error.add_note(f"what was observed is kept in {directory.path}: the same command goes on from there")
            raise


def _training(epochs: int, seed: int) -> tuple[str, ...]:
    return "--epochs", str(epochs), "--seed", str(seed)


def _run(*arguments: str) -> None:
    with stop_on_signals() as stop:
        code = run_setup(_MODULE, *arguments, stop=stop)
    raise typer.Exit(code)
