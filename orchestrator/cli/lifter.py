"""`orchestrator lifter`: renders the training views of a lifter, and fits it by the perception worker's own command."""

from pathlib import Path
from typing import Annotated

import typer

from orchestrator.cli.observation import complete, worker_settings
from orchestrator.cli.options import (
    AllowedOption,
    InsecureOption,
    JoinOption,
    KeyOption,
    WorkersConfigArgument,
    WorkersOption,
    examples,
    host_to_join,
)
from orchestrator.cli.setup_command import run_setup
from protocol.system.stop_request import stop_on_signals

_MODULE = "perception_worker.lifter"

lifter_app = typer.Typer(
    help="A learned lifter: the 3D positions of a body's joints, and the uncertainty of each.", no_args_is_help=True
)


@lifter_app.command(
    "fit",
    epilog=examples(
        "orchestrator lifter fit",
        "orchestrator lifter fit --frames 4000 --epochs 20 --out runs/small-lifter",
    ),
)
def fit(
    config: WorkersConfigArgument = None,
    frames: Annotated[int, typer.Option(min=1, help="How many views to learn from.")] = 60000,
    seed: Annotated[int, typer.Option(min=0, help="Of the views and of the training.")] = 0,
    wide: Annotated[
        float,
        typer.Option(
            min=0, max=1, help="Share of the scenes with poses of the widest ranges instead of the eight kinds."
        ),
    ] = 0.65,
    epochs: Annotated[int, typer.Option(min=1, help="How often each view is learned from.")] = 40,
    workers: WorkersOption = None,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The directory for the fit.", show_default="runs/lifter")
    ] = None,
) -> None:
    """Render views of train identities, and fit a lifter on them; `perception.lifter` selects it.

    After a stop or a kill, the same command continues with the next part of the views, or the next epoch.
    """
    from orchestrator.lifter.directory import DEFAULT_PATH, FitDirectory
    from orchestrator.lifter.observing import observe_fit_views
    from orchestrator.lifter.views import FitViews

    host = host_to_join(join, key, allowed, insecure, workers)
    settings = worker_settings(config, workers, host)
    views = FitViews(frames=frames, seed=seed, wide=wide)
    directory = FitDirectory.open_for(out or DEFAULT_PATH, settings, views)
    parts = directory.parts()
    complete(
        directory,
        parts,
        settings,
        host,
        lambda pools: observe_fit_views(parts, directory.views(), settings.environment, pools),
    )
    _run("fit", str(directory.table_path), "--output", str(directory.lifter_path), *_training(epochs, seed))


@lifter_app.command(
    "show", epilog=examples("orchestrator lifter show", "orchestrator lifter show runs/lifter/lifter.msgpack")
)
def show(
    file: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="A lifter.", show_default="the shipped ones")
    ] = None,
) -> None:
    """Show what a lifter is for, where it comes from, and how certain it is."""
    _run("show", *([] if file is None else [str(file)]))


def _training(epochs: int, seed: int) -> tuple[str, ...]:
    return "--epochs", str(epochs), "--seed", str(seed)


def _run(*arguments: str) -> None:
    with stop_on_signals() as stop:
        code = run_setup(_MODULE, *arguments, stop=stop)
    raise typer.Exit(code)
