"""`orchestrator experiment next-view`: which camera around the present one sees a person best."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
    examples,
    host_to_join,
)
from orchestrator.cli.setup_command import run_setup
from orchestrator.terminal.output import print_json, print_line
from protocol.system.stop_request import stop_on_signals

if TYPE_CHECKING:
    from orchestrator.experiments.next_view.directory import NextViewDirectory

_MODULE = "perception_worker.next_view"

next_view_app = typer.Typer()


@next_view_app.command(
    "next-view",
    epilog=examples(
        "orchestrator experiment next-view --profile thesis",
        "orchestrator experiment next-view --profile thesis --train 64 --test 16 --out runs/experiments/few-scenes",
    ),
)
def next_view(
    config: WorkersConfigArgument = None,
    profile: ProfileOption = "thesis",
    train: Annotated[int, typer.Option(min=1, help="Scenes to learn from.")] = 1024,
    test: Annotated[int, typer.Option(min=1, help="Scenes to test on.")] = 256,
    seed: Annotated[int, typer.Option(min=0, help="Of the scenes.")] = 0,
    spacing: Annotated[float, typer.Option(min=0.1, max=1.4, help="Of the cameras, metres.")] = 1.0,
    trainings: Annotated[int, typer.Option(min=1, help="Of each way of choosing, each with a seed of its own.")] = 5,
    workers: WorkersOption = None,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="The directory.", show_default="runs/experiments/next-view-PROFILE"),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Observe scenes by nine cameras each, and compare ways to choose the best of the eight around the centre.

    After a stop or a kill, the same command continues with the first missing scenes. To fit the choices again, remove
    choices.parquet.
    """
    require_libraries()
    from orchestrator.experiments.next_view.directory import NextViewDirectory, default_path
    from orchestrator.experiments.next_view.observing import observe_arrays
    from orchestrator.experiments.next_view.results import publish
    from orchestrator.experiments.next_view.views import ArrayViews

    host = host_to_join(join, key, allowed, insecure, workers)
    settings = worker_settings(config, workers, host, profile=profile)
    views = ArrayViews(train=train, test=test, seed=seed, spacing=spacing)
    directory = NextViewDirectory.open_for(out or default_path(profile), settings, views)
    parts = directory.parts()
    complete(directory, parts, settings, host, lambda pools: observe_arrays(parts, views, settings, pools))
    _choose(directory, trainings)
    scores = publish(directory)
    if json:
        print_json(scores)
        return
    print_line(directory.page_path.read_text(encoding="utf-8"))
    for path in (directory.table_path, directory.choices_path, directory.scores_path, directory.page_path):
        print_line(path)


def _choose(directory: "NextViewDirectory", trainings: int) -> None:
    """Have the perception worker's own command fit every way of choosing, unless that was done."""
    if directory.choices_path.is_file():
        return
    arguments = str(directory.table_path), "--output", str(directory.choices_path), "--seeds", str(trainings)
    with stop_on_signals() as stop:
        code = run_setup(_MODULE, *arguments, stop=stop)
    if code:
        raise typer.Exit(code)
