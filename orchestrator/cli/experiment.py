"""`orchestrator experiment`: measures the error of pose estimates, and how well their quality predicts it."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from orchestrator.cli.grid import grid_app
from orchestrator.cli.grid_training import grid_training_app
from orchestrator.cli.next_view import next_view_app
from orchestrator.cli.observation import complete, require_libraries, worker_settings
from orchestrator.cli.options import (
    AllowedOption,
    InsecureOption,
    JoinOption,
    JsonOption,
    KeyOption,
    WorkersConfigArgument,
    WorkersOption,
    examples,
    host_to_join,
    worker_count,
)
from orchestrator.terminal.output import print_json, print_line
from protocol.artifact import require_place
from protocol.camera import DepthNoise
from protocol.config_file import require_recorded_files
from protocol.scene import Split

if TYPE_CHECKING:
    from orchestrator.experiments.directory import ExperimentDirectory

experiment_app = typer.Typer(
    help="Experiments: the error of pose estimates and how well their quality predicts it.", no_args_is_help=True
)
grid_app.add_typer(grid_training_app)
experiment_app.add_typer(grid_app, name="grid")
experiment_app.add_typer(next_view_app)


NoiseOption = Annotated[
    Literal["both", "none", "d435i"], typer.Option(help="Of the depth; with both, each view is rendered twice.")
]
PosesOption = Annotated[
    Literal["kinds", "families"], typer.Option(help="Of the people; families are poses that occur in no training.")
]
OutOption = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="The directory; families have -families appended.",
        show_default="runs/experiments/qoe-SPLIT-SEED",
    ),
]
ViewsOption = Annotated[
    int, typer.Option(min=1, help="Views in a row of one scene: making a scene takes as long as nine pictures.")
]


@experiment_app.command(
    "qoe",
    epilog=examples(
        "orchestrator experiment qoe --frames 5000",
        "orchestrator experiment qoe --frames 2000 --poses families",
        "orchestrator experiment qoe configs/full.toml --split train --out runs/experiments/train",
    ),
)
def qoe(
    config: WorkersConfigArgument = None,
    frames: Annotated[int, typer.Option(min=1, help="How many views.")] = 5000,
    split: Annotated[Split, typer.Option(help="The split of identities.")] = "test",
    seed: Annotated[int, typer.Option(min=0, help="Of the views.")] = 0,
    noise: NoiseOption = "both",
    poses: PosesOption = "kinds",
    workers: WorkersOption = None,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    out: OutOption = None,
    views_a_scene: ViewsOption = 4,
    frames_a_part: Annotated[int, typer.Option(min=1, help="Views that a kill loses at most.", hidden=True)] = 250,
    json: JsonOption = False,
) -> None:
    """Observe many views, and report the error of each joint and how well its quality predicts it.

    After a stop or a kill, the same command continues where it was.
    """
    require_libraries()
    from orchestrator.experiments import qoe as experiment
    from orchestrator.experiments.directory import ExperimentDirectory, default_path
    from orchestrator.experiments.views import ViewSet

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
    host = host_to_join(join, key, allowed, insecure, workers)
    settings = worker_settings(config, workers, host)
    directory = ExperimentDirectory.open_for(out or default_path(views), settings, views)
    parts = experiment.table_parts(directory, views)
    complete(directory, parts, settings, host, lambda pools: experiment.observe_views(parts, views, settings, pools))
    _print_results(directory, json)


@experiment_app.command("flights", epilog=examples("orchestrator experiment flights runs/experiments/qoe-test-0"))
def flights(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="An experiment's directory.", show_default=False)],
    scenes: Annotated[int, typer.Option(min=1, help="Each is orbited and approached, with each noise.")] = 20,
    steps: Annotated[int, typer.Option(min=2, help="Pictures of each flight.")] = 40,
    workers: WorkersOption = None,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    json: JsonOption = False,
) -> None:
    """Fly around the people of an experiment with the Kalman filter, and report the quality of its posterior.

    Configuration, seed, people and noise are the experiment's. After a stop or a kill, the same command continues.
    """
    require_libraries()
    from orchestrator.experiments import flights as flying
    from orchestrator.experiments.directory import ExperimentDirectory
    from orchestrator.experiments.workers import with_workers

    found = ExperimentDirectory.open(directory)
    recorded = found.config()
    require_recorded_files(recorded)
    host = host_to_join(join, key, allowed, insecure, workers)
    views, settings = found.views(), with_workers(recorded, worker_count(workers))
    flight_set = flying.FlightSet(scenes=scenes, steps=steps, depth_noises=views.depth_noises)
    found.require_same(found.flight_set_path, flight_set)
    parts = flying.flight_parts(found, flight_set)
    complete(found, parts, settings, host, lambda workers: flying.fly(parts, flight_set, views, settings, workers))
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
        typer.Option(metavar="FILE", help="Also write the page to this file, and its plots to images/ beside it."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Compute an experiment's figures, page and plots again from its tables."""
    require_libraries()
    from orchestrator.experiments.directory import ExperimentDirectory

    _print_results(ExperimentDirectory.open(directory), json, page)


def _print_results(directory: "ExperimentDirectory", json: bool, page: Path | None = None) -> None:
    from orchestrator.experiments.results import publish, work_out

    for file in (directory.page_path, *([] if page is None else [page])):
        # Before the figures, which take long.
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
