"""`orchestrator doctor`: whether this machine has what Vantage needs."""

import typer

from orchestrator.cli.options import JsonOption, examples
from orchestrator.doctor import all_checks, all_needed_passed, checks_table
from orchestrator.terminal.command_group import FAILED
from orchestrator.terminal.output import print_json, show

doctor_app = typer.Typer()


@doctor_app.command(epilog=examples("orchestrator doctor", "orchestrator doctor --json"))
def doctor(json: JsonOption = False) -> None:
    """Check that this machine has what Vantage needs, and say what to do about each thing that it lacks."""
    checks = tuple(all_checks())
    if json:
        print_json(checks)
    else:
        show(checks_table(checks))
    if not all_needed_passed(checks):
        raise typer.Exit(FAILED)
