"""`orchestrator train` and `resume`: a run from its configuration to its report."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from orchestrator import training
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
    host_to_join,
)
from orchestrator.errors import HostNotTold
from orchestrator.monitoring.report import report_view, training_report
from orchestrator.monitoring.telemetry import run_telemetry
from orchestrator.run.run_directory import Plan, RunDirectory
from orchestrator.run.runs import default_run_path
from orchestrator.run.versions import collect_versions
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT
from orchestrator.terminal.output import print_json, show
from protocol.config_file import for_a_run, load_config
from protocol.errors import Interrupted, InvalidInput
from protocol.text import readable

training_app = typer.Typer()


@training_app.command(
    epilog=examples(
        "orchestrator train configs/quickstart.toml",
        "orchestrator train configs/full.toml --run runs/monday",
        "orchestrator train configs/quickstart.toml --json > report.json",
        "orchestrator train configs/full.toml --join tcp://host:5600 --key trainer.key --run runs/monday --or-resume",
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
    or_resume: Annotated[bool, typer.Option("--or-resume", help="Resume the run if it exists already.")] = False,
    join: JoinOption = None,
    key: KeyOption = None,
    allowed: AllowedOption = None,
    insecure: InsecureOption = False,
    http: HttpOption = None,
    http_token: TokenOption = None,
    json: JsonOption = False,
) -> None:
    """Train a policy on real renders, then fly its evaluation.

    Starts render workers, perception workers and the agent as processes on this machine, and shows their state on
    stderr.

    Ctrl-C stops the run in order and keeps what was learned; a second Ctrl-C stops it at once. In either case, and also
    after a process was killed, 'orchestrator resume' continues the run.

    With --join, the run uses the workers of a host ('orchestrator host'), which may be on other machines, and only the
    agent is started here. The host is told when the run is done.
    """
    joining = host_to_join(join, key, allowed, insecure)
    settings = for_a_run(load_config(config), joined=joining is not None)
    if or_resume and run is None:
        raise InvalidInput("--or-resume needs --run, which names the run to resume")
    path = run or default_run_path(config, datetime.now())
    go_on = training.train
    with (
        at_work() as (display, stop),
        run_telemetry(endpoint(http, http_token), readable(path.name), display) as monitors,
    ):
        if or_resume and path.exists():
            directory, go_on = RunDirectory.open(path), training.resume
            settings = directory.config_matching(settings)
            _require_planned(directory, evaluate)
        else:
            plan = Plan(evaluate=evaluate is not False)
            directory = RunDirectory.create(path, settings, collect_versions(PROCESS_ENVIRONMENT), plan)
        ending = _ending_of(lambda: go_on(directory, settings, monitors=monitors, stop=stop, join=joining))
    _print_training(directory, json, ending)


@training_app.command(
    epilog=examples("orchestrator resume runs/monday", "orchestrator resume runs/monday --json > report.json")
)
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
    """Continue a run that was stopped or killed, with the same result as without the interruption.

    Adopts the processes that a killed orchestrator has left, starts those that are missing, and continues: the training
    from its last checkpoint, then the evaluation if one is planned.

    For a finished run, the report is printed again.
    """
    directory = RunDirectory.open(run)
    joining = host_to_join(join, key, allowed, insecure)
    served = endpoint(http, http_token)
    settings = directory.verified_config()
    with at_work() as (display, stop), run_telemetry(served, directory.name, display) as monitors:
        ending = _ending_of(lambda: training.resume(directory, settings, monitors=monitors, stop=stop, join=joining))
    _print_training(directory, json, ending)


def _require_planned(run: RunDirectory, evaluate: bool | None) -> None:
    """Raise `InvalidInput` if the run's plan says otherwise on whether to evaluate."""
    planned = run.plan().evaluate
    if evaluate not in (None, planned):
        option, made = ("--no-evaluate", "with") if planned else ("--evaluate", "without")
        raise InvalidInput(
            f"{option}: {run.path} was made {made} an evaluation, and a run is never changed: leave the option out"
            + ("" if planned else f", and fly one by 'orchestrator evaluate {run.path}'")
        )


def _ending_of(work: Callable[[], None]) -> Interrupted | HostNotTold | None:
    """Do the work; returns the error to raise after its report was printed."""
    try:
        work()
    except (Interrupted, HostNotTold) as error:
        return error
    return None


def _print_training(run: RunDirectory, json: bool, ending: Interrupted | HostNotTold | None) -> None:
    """Print the report of a training, also of one that was stopped, and then raise its ending."""
    report = training_report(run, interrupted=isinstance(ending, Interrupted))
    if report is not None and json:
        print_json(report)
    elif report is not None:
        show(report_view(report))
    if ending is not None:
        raise ending
