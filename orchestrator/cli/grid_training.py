"""`orchestrator experiment grid train`, `evaluate` and `report`: policies that explore, and what came of them."""

import os
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from msgspec import Struct

from orchestrator import training
from orchestrator.cli.observation import require_libraries
from orchestrator.cli.options import JsonOption, at_work, examples
from orchestrator.errors import RunError
from orchestrator.monitoring.grid_table import grid_tables
from orchestrator.run.run_directory import RunDirectory
from orchestrator.supervision.launch import Evaluate
from orchestrator.terminal.output import print_json, print_line, show
from protocol.artifact import whole_file
from protocol.config import RunConfig
from protocol.config_file import for_a_run, load_config
from protocol.errors import InvalidInput
from protocol.grid.named_tables import table_path
from protocol.grid.records import GridEvaluation
from protocol.grid.table import read_stored_table, read_table
from protocol.grid.threshold import weighted_uncertainties
from protocol.text import json_of

grid_training_app = typer.Typer()


class GridTrainings(Struct, frozen=True):
    """The output of `experiment grid train --json`: the run directories."""

    runs: tuple[str, ...]


DEFAULT_OUT = Path("runs/experiments/grid")
OutOption = Annotated[Path, typer.Option("--out", metavar="DIR", help="The directory of the trainings.")]


@grid_training_app.command(
    "train",
    epilog=examples(
        "orchestrator experiment grid train configs/grid.toml",
        "orchestrator experiment grid train configs/grid.toml --variant quality --seeds 5",
    ),
)
def train(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="What all trainings have in common.")],
    variant: Annotated[
        list[str] | None, typer.Option(help="A variant to train; may be given more than once.", show_default="all")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Trainings of each variant.")] = 3,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Trainings at a time.", show_default="one for each core")
    ] = None,
    out: OutOption = DEFAULT_OUT,
    json: JsonOption = False,
) -> None:
    """Train the variants of the exploration experiment, each with several seeds, and evaluate each.

    After a stop or a kill, the same command continues what was begun. Each training is a run directory of its own.
    """
    from orchestrator.experiments.grid.training_processes import TrainingProcesses
    from orchestrator.experiments.grid.variants import VARIANTS, trainings

    planned = trainings(out, for_a_run(load_config(config)), variant or list(VARIANTS), seeds)
    out.mkdir(parents=True, exist_ok=True)
    with at_work() as (display, stop):
        TrainingProcesses(out, jobs or os.cpu_count() or 1, display, stop).train(planned)
    trained = GridTrainings(runs=tuple(str(one.path) for one in planned))
    if json:
        print_json(trained)
    else:
        print_line("\n".join([*trained.runs, f"a report of them: orchestrator experiment grid report {out}"]))


@grid_training_app.command(
    "evaluate",
    epilog=examples(
        "orchestrator experiment grid evaluate runs/monday",
        "orchestrator experiment grid evaluate runs/experiments/grid/quality-seed-0 --json",
    ),
)
def evaluate(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="A run directory of a training on the grid.", show_default=False)
    ],
    again: Annotated[
        bool, typer.Option("--again", help="Walk again, also where these weights were evaluated.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Walk every start in every test environment, and print success, crashes, lengths, ceiling and optimum.

    The run's policy and the baselines are evaluated at the run's threshold, at the one by rule and at the thesis's.
    """
    directory = RunDirectory.open(run)
    config = directory.verified_config()
    _require_grid(run, config)
    evaluation = directory.grid_evaluation()
    if again or evaluation is None or not directory.is_evaluated():
        with at_work() as (display, stop):
            training.evaluate(directory, config, Evaluate(), display=display, stop=stop)
        evaluation = directory.grid_evaluation()
    if evaluation is None:
        raise RunError(f"{directory.grid_path} is missing or damaged after the evaluation")
    _print(evaluation, as_json=json)


@grid_training_app.command(
    "report",
    epilog=examples("orchestrator experiment grid report", "orchestrator experiment grid report runs/grid --json"),
)
def report(
    out: Annotated[
        Path, typer.Argument(metavar="[DIR]", help="The directory of the trainings.", show_default=str(DEFAULT_OUT))
    ] = DEFAULT_OUT,
    json: JsonOption = False,
) -> None:
    """Compare the trainings of a directory: tables beside the thesis's, learning curves, walks on maps.

    Writes figures.json, figures.md and plots/ there.
    """
    require_libraries()
    from orchestrator.experiments.grid.page import page
    from orchestrator.experiments.grid.plots import write_plots
    from orchestrator.experiments.grid.results import grid_figures, trained_runs
    from orchestrator.experiments.grid.walked import Walked

    runs = trained_runs(out)
    figures = grid_figures(runs)
    first = runs[0]
    table = read_table(table_path(first.evaluation.table))
    write_plots(out / "plots", runs, Walked.read(first.directory.path / "walks.npz"), table)
    for path, text in (
        (out / "figures.json", msgspec.json.format(json_of(figures), indent=2) + b"\n"),
        (out / "figures.md", page(figures).encode()),
    ):
        with whole_file(path) as aside:
            aside.write_bytes(text)
    if json:
        print_json(figures)
    else:
        print_line(page(figures))


@grid_training_app.command(
    "animate",
    epilog=examples(
        "orchestrator experiment grid animate runs/experiments/grid/quality-seed-0",
        "orchestrator experiment grid animate runs/monday --episode 12000 --out episode.gif",
    ),
)
def animate(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run directory that was evaluated.", show_default=False)],
    episode: Annotated[
        int | None,
        typer.Option(min=0, help="Its number in walks.npz.", show_default="one that begins behind the person"),
    ] = None,
    length: Annotated[int, typer.Option(min=1, help="Steps of the chosen episode, about.")] = 9,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="A GIF.", show_default="RUN/episode.gif")] = None,
) -> None:
    """Draw an episode of a run's evaluation as an animated picture: what the camera saw, and the walk on the map.

    Starts render workers, which draw the scene again by the table's recipe.
    """
    require_libraries()
    from orchestrator.experiments.grid import animation, checking
    from orchestrator.experiments.grid.observing import GridObserver
    from orchestrator.experiments.grid.walked import Walked
    from orchestrator.experiments.workers import Rate, experiment_workers, with_workers

    config = RunDirectory.open(run).verified_config()
    _require_grid(run, config)
    path = table_path(config.grid.table)
    stored, table = read_stored_table(path), read_table(path)
    told, views = checking.settings_of(stored, path)
    split = table.of_split("test")
    weighted, walked = weighted_uncertainties(table)[split], Walked.read(run / "walks.npz")
    number = animation.telling_episode(walked, weighted, length) if episode is None else episode
    place, cells = int(walked.place[number]), walked.cells_of(number)
    drawn = animation.AnimatedEpisode(table.places[split[place]], weighted[place], walked.threshold, cells)
    settings = with_workers(told, 1)
    with at_work() as (display, stop), experiment_workers(settings, display=display, stop=stop) as pools:
        observer = GridObserver(views, settings, pools, Rate(len(cells)))
        seen = list(observer.pictures(int(split[place]), cells))
    file = out or run / "episode.gif"
    animation.animate(file, drawn, seen)
    print_line(file)


def _print(evaluation: GridEvaluation, *, as_json: bool) -> None:
    if as_json:
        print_json(evaluation)
    else:
        show(grid_tables(evaluation))


def _require_grid(run: Path, config: RunConfig) -> None:
    if not config.is_grid:
        raise InvalidInput(f"{run} trained on {config.env_id}: evaluate it by 'orchestrator evaluate {run}'")
