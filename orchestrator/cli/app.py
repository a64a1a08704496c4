"""The `orchestrator` command: the commands of every file here, in the order of its help."""

from typing import Annotated

import typer

from orchestrator.cli.calibration import calibration_app
from orchestrator.cli.chaos import chaos_app
from orchestrator.cli.doctor import doctor_app
from orchestrator.cli.evaluation import evaluation_app
from orchestrator.cli.experiment import experiment_app
from orchestrator.cli.host import host_app
from orchestrator.cli.lifter import lifter_app
from orchestrator.cli.options import examples
from orchestrator.cli.setup import bodies_app, keys_app, models_app
from orchestrator.cli.status import status_app
from orchestrator.cli.training import training_app
from orchestrator.cli.view import view_app
from orchestrator.run.versions import installed_version
from orchestrator.terminal.command_group import Sentences
from orchestrator.terminal.output import print_line

app = typer.Typer(
    cls=Sentences,
    help="Trains where a drone should fly so that a person's 3D pose is seen with certainty.",
    epilog=examples("orchestrator doctor", "orchestrator train configs/quickstart.toml", "orchestrator status"),
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for commands in (training_app, host_app, evaluation_app, status_app, doctor_app, chaos_app, view_app):
    app.add_typer(commands)
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
