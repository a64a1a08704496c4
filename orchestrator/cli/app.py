"""The `orchestrator` command: reads arguments, hands them on, and prints what comes back."""

import os
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from orchestrator import training
from orchestrator.cli.calibration import calibration_app
from orchestrator.cli.experiment import experiment_app
from orchestrator.cli.lifter import lifter_app
from orchestrator.cli.options import (
    AllowedOption,
    HttpOption,
    InsecureOption,
    JoinOption,
    JsonOption,
    KeyOption,
    TokenOption,
    at_work,
    endpoint,
    examples,
)
from orchestrator.cli.setup import bodies_app, keys_app, models_app
from orchestrator.doctor import all_checks, all_needed_passed, checks_table
from orchestrator.errors import HostNotTold, Interrupted, RunError
from orchestrator.hosting.host import HostOrder
from orchestrator.hosting.host import host as serve_host
from orchestrator.hosting.host_display import open_host_display
from orchestrator.hosting.joining import join_of
from orchestrator.monitoring.report import report_view, training_report
from orchestrator.monitoring.status import RunStatus, run_status, status_view
from orchestrator.monitoring.table import evaluation_table
from orchestrator.monitoring.telemetry import host_telemetry, run_telemetry
from orchestrator.run.run_directory import Plan, RunDirectory, default_run_path, newest_run
from orchestrator.run.versions import collect_versions, installed_version
from orchestrator.stop_request import stop_on_signals
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT, Evaluate
from orchestrator.terminal.command_group import FAILED, Sentences
from orchestrator.terminal.console import open_console
from orchestrator.terminal.output import print_json, print_line, show
from protocol.artifact import require_place
from protocol.config_file import for_a_run, load_config
from protocol.errors import InvalidInput
from protocol.scene import Split
from protocol.security.options import security_from
from protocol.telemetry.endpoint import parse_endpoint
from protocol.text import readable

app = typer.Typer(
    cls=Sentences,
    help="Trains where a drone should fly so that a person's 3D pose is seen with certainty.",
    epilog=examples("orchestrator doctor", "orchestrator train configs/quickstart.toml", "orchestrator status"),
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(models_app, name="models")
app.add_typer(bodies_app, name="bodies")
app.add_typer(keys_app, name="keys")
app.add_typer(calibration_app, name="calibration")
app.add_typer(lifter_app, name="lifter")
app.add_typer(experiment_app, name="experiment")


def main() -> None:
    """The entry point."""
    app(prog_name="orchestrator")


def _print_version(wanted: bool) -> None:
    if wanted:
        print_line(f"vantage {installed_version('vantage') or '(not installed)'}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    pass


@app.command(
    epilog=examples(
        "orchestrator train configs/quickstart.toml",
        "orchestrator train configs/full.toml --run runs/monday",
        "orchestrator train configs/quickstart.toml --json > report.json",
        "orchestrator train configs/full.toml --join tcp://hub:5600 --key trainer.key --run runs/monday --or-resume",
    )
)
def train(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="A configuration file (TOML).", show_default=False)],
    run: Annotated[
        Path | None, typer.Option(help="The run directory to make.", show_default="runs/CONFIG-DATE-TIME")
    ] = None,
    evaluate: Annotated[
        bool | None,
        typer.Option(
            "--evaluate/--no-evaluate", help="Fly the evaluation after the training.", show_default="evaluate"
        ),
    ] = None,
    or_resume: Annotated[bool, typer.Option("--or-resume", help="Go on with the run if it is there already.")] = False,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    http: HttpOption = None,
    http_token: TokenOption = None,
    json: JsonOption = False,
) -> None:
    """Train a policy on real renders, then fly its evaluation.

    Starts render workers, perception workers and the agent as processes here, and shows on stderr how they do.

    Ctrl-C stops in order and keeps what was learned; a second one stops at once. Either way, and also where any of the
    processes was killed, 'orchestrator resume' goes on.

    With --join the workers are those of a host ('orchestrator host'), perhaps on other machines, and the agent alone is
    started here. The host is told when the run is done.
    """
    joining = join_of(join, key, allowed, insecure=insecure, environment=os.environ)
    settings = for_a_run(load_config(config), joined=joining is not None)
    if or_resume and run is None:
        raise InvalidInput("--or-resume goes on with the run of a name; it needs --run")
    path = run or default_run_path(config, datetime.now())
    go_on = training.train
    with (
        at_work() as (display, stop),
        run_telemetry(endpoint(http, http_token), readable(path.name), display) as monitors,
    ):
        if or_resume and path.exists():
            directory, go_on = RunDirectory.open_for(path, settings), training.resume
            _require_planned(directory, evaluate)
        else:
            plan = Plan(evaluate=evaluate is not False)
            directory = RunDirectory.create(path, settings, collect_versions(PROCESS_ENVIRONMENT), plan)
        ending = _ending_of(lambda: go_on(directory, monitors=monitors, stop=stop, join=joining))
    _print_training(directory, json, ending)


@app.command(epilog=examples("orchestrator resume runs/monday", "orchestrator resume runs/monday --json > report.json"))
def resume(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run directory.", show_default=False)],
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    http: HttpOption = None,
    http_token: TokenOption = None,
    json: JsonOption = False,
) -> None:
    """Bring a run to its end from wherever it stands, whatever was killed or stopped, as if nothing had happened.

    Takes up the processes that an orchestrator which was killed has left, starts those that are missing, and goes on:
    training from its last checkpoint, then the evaluation if the run was to have one.

    Of a run that has come to its end the report is printed again.
    """
    directory = RunDirectory.open(run)
    joining = join_of(join, key, allowed, insecure=insecure, environment=os.environ)
    served = endpoint(http, http_token)
    directory.require_as_it_was()
    with at_work() as (display, stop), run_telemetry(served, directory.name, display) as monitors:
        ending = _ending_of(lambda: training.resume(directory, monitors=monitors, stop=stop, join=joining))
    _print_training(directory, json, ending)


@app.command(
    epilog=examples(
        "orchestrator host --key hub.key",
        "orchestrator host --bind tcp://127.0.0.1:5600 --http 8000 --stay",
    )
)
def host(
    bind: Annotated[str, typer.Option(metavar="ADDRESS", help="Where to serve.")] = "tcp://0.0.0.0:5600",
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    http: HttpOption = None,
    http_token: TokenOption = None,
    stay: Annotated[bool, typer.Option("--stay", help="Go on when the runs are done, with the workers.")] = False,
) -> None:
    """Be where workers and runs on several machines find each other; start nothing.

    Workers register with '--orchestrator ADDRESS', runs join by 'orchestrator train --join ADDRESS'. Once a run is done
    and no other is under way, the workers end, and then this. Killed and started again, it is found again by all.
    """
    security = security_from(key, allowed, insecure=insecure, environment=os.environ)
    order = HostOrder(bind=bind, stay=stay, security=security)
    with (
        stop_on_signals() as stop,
        open_host_display(open_console(stderr=True)) as display,
        host_telemetry(endpoint(http, http_token), bind, display) as monitors,
    ):
        serve_host(order, display=monitors.display, stop=stop, observer=monitors.registry)


@app.command(
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
    directory.require_as_it_was()
    with at_work() as (display, stop):
        what = Evaluate(episodes=episodes, policies=tuple(policy or ()))
        training.evaluate(directory, what, display=display, stop=stop)
    evaluation = directory.evaluation()
    if evaluation is None:
        raise RunError(f"the agent left no whole {directory.evaluation_path}")
    if json:
        print_json(evaluation)
    else:
        show(evaluation_table(evaluation))


@app.command(
    epilog=examples(
        "orchestrator status",
        "orchestrator status runs/monday --json",
        "orchestrator status --http gpu-box:8000 --http jetson:8000",
    )
)
def status(
    run: Annotated[
        Path | None, typer.Argument(metavar="[RUN]", help="A run directory.", show_default="the newest in runs/")
    ] = None,
    http: Annotated[
        list[str] | None,
        typer.Option(metavar="[HOST:]PORT", help="Instead ask a process there; may be given more than once."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Say how a run is: what its agent does, and each worker's own word.

    Processes on other machines are asked where their own --http says. Ends with 1 if one of these is not ready.
    """
    if http:
        if run is not None:
            raise InvalidInput("name a run on this machine, or by --http processes on any; not both")
        _print_reports(http, json)
    else:
        _print_status(run_status(RunDirectory.open(run) if run else newest_run()), json)


@app.command(epilog=examples("orchestrator doctor", "orchestrator doctor --json"))
def doctor(json: JsonOption = False) -> None:
    """Check that this machine has what Vantage needs, and say what to do about each thing that it lacks."""
    checks = tuple(all_checks())
    if json:
        print_json(checks)
    else:
        show(checks_table(checks))
    if not all_needed_passed(checks):
        raise typer.Exit(FAILED)


@app.command(
    epilog=examples(
        "orchestrator chaos configs/quickstart.toml --faults 20 --seed 7",
        "orchestrator chaos configs/quickstart.toml --faults 5 --only kill-agent --only stop-render",
    )
)
def chaos(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="A configuration file (TOML).", show_default=False)],
    faults: Annotated[int, typer.Option(min=1, help="How many; from 20 on each class has its turn.")] = 20,
    seed: Annotated[int, typer.Option(help="Decides which fault strikes when.")] = 0,
    only: Annotated[
        list[str] | None, typer.Option(help="A fault class; may be given more than once.", show_default="all")
    ] = None,
    runs: Annotated[Path, typer.Option(help="Where the runs are made.")] = Path("runs/chaos"),
    json: JsonOption = False,
) -> None:
    """Train once untouched and once under faults, and compare weights, episodes and replay byte for byte."""
    from orchestrator.chaos import rehearsal, report
    from orchestrator.chaos.scenarios import catalogue

    scenarios = catalogue.chosen(tuple(only or ()))
    order = rehearsal.Order(config=config, faults=faults, seed=seed, scenarios=scenarios, runs=runs)
    with at_work() as (display, stop):
        found = rehearsal.rehearse(order, display, stop)
    if json:
        print_json(found)
    else:
        show(report.report_view(found))
    if not found.passed:
        raise typer.Exit(FAILED)


@app.command(
    "view",
    epilog=examples(
        "orchestrator view 7",
        "orchestrator view 7 --distance 2.5 --angle 30 --output handover.png",
        "orchestrator view 1 2 3 --split train --output pictures/",
    ),
)
def view_scenes(
    scenes: Annotated[list[int], typer.Argument(metavar="SCENE...", help="The scenes' seeds.", show_default=False)],
    split: Annotated[Split, typer.Option(help="Of whose people.")] = "test",
    distance: Annotated[float, typer.Option(help="Metres from the person, along the ground.")] = 3.0,
    angle: Annotated[float, typer.Option(help="Degrees from the person's front; 90 is at their left.")] = 0.0,
    altitude: Annotated[float, typer.Option(help="Metres above the ground.")] = 1.6,
    bystanders: Annotated[int, typer.Option(help="How many more people are there, 0 to 8.")] = 0,
    size: Annotated[str | None, typer.Option(help="Of the camera's picture.", show_default="640x480")] = None,
    config: Annotated[Path | None, typer.Option(help="A configuration for the workers and the camera.")] = None,
    output: Annotated[
        Path | None, typer.Option(help="A file, or a directory for many scenes.", show_default="scene-SEED.png")
    ] = None,
) -> None:
    """Draw what the drone would see of scenes: colour, depth, heatmaps, the skeleton, and its joints in space."""
    # OpenCV and Pillow take their time to load, and no other command needs them.
    from orchestrator.pictures import view as viewing

    viewpoint = viewing.Viewpoint(distance=distance, angle=angle, altitude=altitude)
    look = viewing.Look(seeds=tuple(dict.fromkeys(scenes)), split=split, viewpoint=viewpoint, bystanders=bystanders)
    settings = viewing.view_config(config, size)
    files = viewing.picture_files(look.seeds, output)
    for file in files.values():
        # Before anybody draws.
        require_place(file)

    def write(seed: int, page: viewing.UInt8Array) -> None:
        viewing.write_picture(files[seed], page)
        print_line(files[seed])

    with at_work() as (display, stop):
        viewing.view(look, settings, show=write, display=display, stop=stop)


def _require_planned(run: RunDirectory, evaluate: bool | None) -> None:
    """Raise `InvalidInput` where a run that is there was made to end otherwise, with an evaluation or without."""
    planned = run.plan().evaluate
    if evaluate not in (None, planned):
        option, made = ("--no-evaluate", "with") if planned else ("--evaluate", "without")
        raise InvalidInput(
            f"{option}: {run.path} was made {made} an evaluation, and a run is never changed: leave the option out"
            + ("" if planned else f", and fly one by 'orchestrator evaluate {run.path}'")
        )


def _print_status(found: RunStatus, json: bool) -> None:
    if json:
        print_json(found)
    else:
        show(status_view(found))


def _print_reports(places: list[str], json: bool) -> None:
    # No other command needs httpx.
    from orchestrator.monitoring.process_report import process_reports, reports_table

    reports = process_reports([parse_endpoint(place) for place in places])
    if json:
        print_json(reports)
    else:
        show(reports_table(reports))
    if not all(report.ready for report in reports):
        raise typer.Exit(FAILED)


def _ending_of(work: Callable[[], None]) -> Interrupted | HostNotTold | None:
    """Do something, and tell what is to be said of its end once its outcome was printed."""
    try:
        work()
    except (Interrupted, HostNotTold) as error:
        return error
    return None


def _print_training(run: RunDirectory, json: bool, ending: Interrupted | HostNotTold | None) -> None:
    """Print what a training came to, even one that was stopped, and then raise what there is to say of its end."""
    report = training_report(run, interrupted=isinstance(ending, Interrupted))
    if report is not None and json:
        print_json(report)
    elif report is not None:
        show(report_view(report))
    if ending is not None:
        raise ending
