"""`orchestrator experiment`: measures how far an estimate and its quality can be trusted."""

import importlib.util
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from orchestrator.cli.options import (
    AllowedOption,
    InsecureOption,
    JoinOption,
    JsonOption,
    KeyOption,
    at_work,
    examples,
    worker_count,
)
from orchestrator.hosting.joining import Join, join_of
from orchestrator.run.versions import collect_versions
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT
from orchestrator.terminal.output import print_json, print_line
from protocol.artifact import require_place
from protocol.camera import DepthNoise
from protocol.config import RunConfig
from protocol.config_file import load_config, require_recorded_files, with_checksums
from protocol.errors import InvalidInput, VantageError
from protocol.scene import Split

if TYPE_CHECKING:
    from orchestrator.experiments.directory import ExperimentDirectory
    from orchestrator.experiments.parts import Parts
    from orchestrator.experiments.workers import WorkerPools

experiment_app = typer.Typer(
    help="How far poses and their quality can be trusted, measured on many views.", no_args_is_help=True
)

WorkersOption = Annotated[int | None, typer.Option(min=1, help="Perception workers.", show_default="one for each core")]


@experiment_app.command(
    "qoe",
    epilog=examples(
        "orchestrator experiment qoe --frames 5000",
        "orchestrator experiment qoe --frames 2000 --poses families",
        "orchestrator experiment qoe configs/full.toml --split train --out runs/experiments/train",
    ),
)
def qoe(
    config: Annotated[
        Path | None, typer.Argument(metavar="[CONFIG]", help="Of the workers.", show_default="every default")
    ] = None,
    frames: Annotated[int, typer.Option(min=1, help="How many views.")] = 5000,
    split: Annotated[Split, typer.Option(help="Of whose people.")] = "test",
    seed: Annotated[int, typer.Option(min=0, help="Of the views.")] = 0,
    noise: Annotated[
        Literal["both", "none", "d435i"], typer.Option(help="Of the depth; with both, each view is taken twice.")
    ] = "both",
    poses: Annotated[
        Literal["kinds", "families"], typer.Option(help="Of the people; families are poses that no training draws.")
    ] = "kinds",
    workers: WorkersOption = None,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Where it goes; families have -families appended.",
            show_default="runs/experiments/qoe-SPLIT-SEED",
        ),
    ] = None,
    views_a_scene: Annotated[
        int, typer.Option(min=1, help="Views in a row of one scene: making another takes as long as nine pictures.")
    ] = 4,
    frames_a_part: Annotated[int, typer.Option(min=1, help="Views that a kill costs at most.", hidden=True)] = 250,
    json: JsonOption = False,
) -> None:
    """Observe many views, and tell how far each joint and its quality can be trusted, with tables and plots.

    Stopped or killed, the same command goes on where it was.
    """
    _require_libraries()
    from orchestrator.experiments import qoe as experiment
    from orchestrator.experiments.directory import ExperimentDirectory, default_path
    from orchestrator.experiments.views import ViewSet
    from orchestrator.experiments.workers import with_workers

    noises: tuple[DepthNoise, ...] = ("none", "d435i") if noise == "both" else (noise,)
    views = ViewSet(
        frames=frames,
        split=split,
        seed=seed,
        depth_noises=noises,
        views_a_scene=views_a_scene,
        frames_a_part=frames_a_part,
        poses=poses,
    )
    count = worker_count(workers, join)
    host = join_of(join, key, allowed, insecure=insecure, environment=os.environ)
    told = load_config(config) if config else RunConfig()
    settings = with_workers(told if host else with_checksums(told), count)
    directory = ExperimentDirectory.open_for(out or default_path(views), settings, views)
    parts = experiment.table_parts(directory, views)
    _complete(directory, parts, settings, host, lambda pools: experiment.observe_views(parts, views, settings, pools))
    _print_results(directory, json)


@experiment_app.command("flights", epilog=examples("orchestrator experiment flights runs/experiments/qoe-test-0"))
def flights(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="An experiment's directory.", show_default=False)],
    scenes: Annotated[int, typer.Option(min=1, help="Each is flown around and approached, with each noise.")] = 20,
    steps: Annotated[int, typer.Option(min=2, help="Pictures of each flight.")] = 40,
    workers: WorkersOption = None,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    json: JsonOption = False,
) -> None:
    """Fly about the people of an experiment with the Kalman filter, and tell what its posterior is worth.

    Configuration, seed, people and noise are the experiment's. Stopped or killed, the same command goes on.
    """
    _require_libraries()
    from orchestrator.experiments import flights as flying
    from orchestrator.experiments.directory import ExperimentDirectory
    from orchestrator.experiments.workers import with_workers

    found = ExperimentDirectory.open(directory)
    recorded = found.config()
    require_recorded_files(recorded)
    views, settings = found.views(), with_workers(recorded, worker_count(workers, join))
    flight_set = flying.FlightSet(scenes=scenes, steps=steps, depth_noises=views.depth_noises)
    found.require_same(found.flight_set_path, flight_set)
    parts = flying.flight_parts(found, flight_set)
    host = join_of(join, key, allowed, insecure=insecure, environment=os.environ)
    _complete(found, parts, settings, host, lambda workers: flying.fly(parts, flight_set, views, settings, workers))
    _print_results(found, json)


@experiment_app.command(
    "figures",
    epilog=examples(
        "orchestrator experiment figures runs/experiments/qoe-test-0",
        "orchestrator experiment figures runs/experiments/qoe-test-0 --page docs/results-qoe.md",
    ),
)
def figures(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="An experiment's directory.", show_default=False)],
    page: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the page there too, and its plots into images/ beside it."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Work out an experiment's figures, page and plots anew from its tables."""
    _require_libraries()
    from orchestrator.experiments.directory import ExperimentDirectory

    _print_results(ExperimentDirectory.open(directory), json, page)


def _complete(
    directory: "ExperimentDirectory",
    parts: "Parts",
    settings: RunConfig,
    host: Join | None,
    observe: Callable[["WorkerPools"], None],
) -> None:
    """Have the parts of a table made that are missing, and the table of them."""
    from orchestrator.experiments.qoe import provenance
    from orchestrator.experiments.workers import experiment_workers

    with directory.lock(), at_work() as (display, stop):
        if parts.is_whole:
            return
        try:
            with experiment_workers(settings, host, display=display, stop=stop) as workers:
                observe(workers)
                versions = collect_versions(PROCESS_ENVIRONMENT)
                parts.join(provenance(settings, directory.views(), versions, workers.capabilities()))
        except VantageError as error:
            error.add_note(f"what was observed is kept in {directory.path}: the same command goes on from there")
            raise


def _print_results(directory: "ExperimentDirectory", json: bool, page: Path | None = None) -> None:
    from orchestrator.experiments.results import publish, work_out

    for file in (directory.page_path, *([] if page is None else [page])):
        # Before the figures, which take their time.
        require_place(file)
    results = work_out(directory)
    if page is not None:
        publish(directory, results, page)
    if json:
        print_json(results)
        return
    print_line(directory.page_path.read_text(encoding="utf-8"))
    for path in (directory.table_path, directory.figures_path, directory.page_path, *sorted(directory.plots.iterdir())):
        print_line(path)


def _require_libraries() -> None:
    """Raise `InvalidInput` where the extra that experiments need is not installed.

    Their modules are loaded by the commands: these libraries take their time, and no other command needs them.
    """
    if lacking := [name for name in ("pyarrow", "scipy", "matplotlib") if importlib.util.find_spec(name) is None]:
        raise InvalidInput(f"experiments need {', '.join(lacking)}; install vantage's extra 'experiments'")
