"""`orchestrator models`, `bodies` and `keys`: what a machine is given once, before anything runs on it."""

from pathlib import Path
from typing import Annotated

import typer

from orchestrator import keys
from orchestrator.cli.options import JsonOption, examples
from orchestrator.cli.setup_command import run_setup
from orchestrator.stop_request import stop_on_signals
from orchestrator.terminal.output import print_json, print_line, show
from protocol.messages import Role

models_app = typer.Typer(help="The pose networks in the user's cache.", no_args_is_help=True)
bodies_app = typer.Typer(help="The bodies in the user's cache.", no_args_is_help=True)
keys_app = typer.Typer(
    help="The keys under which processes on several machines speak with each other.", no_args_is_help=True
)

KeysOption = Annotated[Path, typer.Option("--dir", help="Where the keys and the list of allowed ones are.")]
ForceOption = Annotated[bool, typer.Option("--force", help="Make it anew even if it is there.")]


@models_app.command("pull", epilog=examples("orchestrator models pull", "orchestrator models pull movenet_thunder"))
def pull_models(
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME]...", show_default="the default network")] = None,
    everything: Annotated[bool, typer.Option("--all", help="Every network known by name.")] = False,
    force: ForceOption = False,
) -> None:
    """Fetch pose networks into the user's cache, unless they are there and whole."""
    flags = [*(["--all"] if everything else []), *(["--force"] if force else [])]
    _run_setup("perception_worker.networks", "pull", *flags, *(names or []))


@models_app.command("list", epilog=examples("orchestrator models list", "orchestrator models list --json"))
def list_models(json: JsonOption = False) -> None:
    """Say which pose networks are known by name, and whether each is in the user's cache."""
    _run_setup("perception_worker.networks", "list", *(["--json"] if json else []))


@bodies_app.command("bake", epilog=examples("orchestrator bodies bake"))
def bake_bodies(force: ForceOption = False) -> None:
    """Make the file of bodies in the user's cache, unless it is there and whole (about two minutes)."""
    _run_setup("render_worker.bake", *(["--force"] if force else []))


@keys_app.command("new", epilog=examples("orchestrator keys new gpu-box --role render"))
def new_key(
    name: Annotated[str, typer.Argument(metavar="NAME", help="What to call it.", show_default=False)],
    role: Annotated[Role, typer.Option(help="What its holder may be.", show_default=False)],
    directory: KeysOption = Path("keys"),
) -> None:
    """Make a key, and allow it. Copy its file and allowed.json to the machine that is to have it."""
    print_line(keys.new_key(directory, name, role))


@keys_app.command("list", epilog=examples("orchestrator keys list", "orchestrator keys list --json"))
def list_keys(directory: KeysOption = Path("keys"), json: JsonOption = False) -> None:
    """Say which keys there are, and which of them count."""
    found = keys.listed_keys(directory)
    if json:
        print_json(found.keys)
    else:
        show(keys.keys_table(found), soft_wrap=True)


@keys_app.command("revoke", epilog=examples("orchestrator keys revoke gpu-box"))
def revoke_key(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Which key.", show_default=False)],
    directory: KeysOption = Path("keys"),
) -> None:
    """Let a key count no more: at once where allowed.json is this file, elsewhere when it has been copied there."""
    keys.revoke_key(directory, name)


def _run_setup(module: str, *arguments: str) -> None:
    with stop_on_signals() as stop:
        code = run_setup(module, *arguments, stop=stop)
    raise typer.Exit(code)
