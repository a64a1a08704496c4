"""`orchestrator models`, `bodies` and `keys`: the set-up of a machine."""

from pathlib import Path
from typing import Annotated

import typer

from orchestrator import keys
from orchestrator.cli.options import JsonOption, examples
from orchestrator.cli.setup_command import run_setup
from orchestrator.terminal.output import print_json, print_line, show
from protocol.messages import Role
from protocol.system.stop_request import stop_on_signals

models_app = typer.Typer(help="The pose networks in the user's cache.", no_args_is_help=True)
bodies_app = typer.Typer(help="The bodies in the user's cache.", no_args_is_help=True)
keys_app = typer.Typer(help="The keys for connections between machines.", no_args_is_help=True)

KeysOption = Annotated[Path, typer.Option("--dir", help="The directory of the keys and of the list of allowed keys.")]
ForceOption = Annotated[bool, typer.Option("--force", help="Make it again even if it exists.")]


@models_app.command("pull", epilog=examples("orchestrator models pull", "orchestrator models pull movenet_thunder"))
def pull_models(
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME]...", show_default="the default network")] = None,
    everything: Annotated[bool, typer.Option("--all", help="Every network known by name.")] = False,
    force: ForceOption = False,
) -> None:
    """Fetch pose networks into the user's cache, unless they are there and intact."""
    flags = [*(["--all"] if everything else []), *(["--force"] if force else [])]
    _run_setup("perception_worker.networks", "pull", *flags, *(names or []))


@models_app.command("list", epilog=examples("orchestrator models list", "orchestrator models list --json"))
def list_models(json: JsonOption = False) -> None:
    """List the pose networks that are known by name, and whether each is in the user's cache."""
    _run_setup("perception_worker.networks", "list", *(["--json"] if json else []))


@bodies_app.command("bake", epilog=examples("orchestrator bodies bake"))
def bake_bodies(force: ForceOption = False) -> None:
    """Make the file of bodies in the user's cache, unless it is there and intact (about two minutes)."""
    _run_setup("render_worker.bake", *(["--force"] if force else []))


@keys_app.command("new", epilog=examples("orchestrator keys new gpu-box --role render"))
def new_key(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The name of the key.", show_default=False)],
    role: Annotated[Role, typer.Option(help="The role that its holder may have.", show_default=False)],
    directory: KeysOption = Path("keys"),
) -> None:
    """Make a key, and allow it. Copy its file and allowed.json to the machine that uses it."""
    print_line(keys.new_key(directory, name, role))


@keys_app.command("list", epilog=examples("orchestrator keys list", "orchestrator keys list --json"))
def list_keys(directory: KeysOption = Path("keys"), json: JsonOption = False) -> None:
    """List the keys, and which of them are allowed."""
    found = keys.listed_keys(directory)
    if json:
        print_json(found.keys)
    else:
        show(keys.keys_table(found), soft_wrap=True)


@keys_app.command("revoke", epilog=examples("orchestrator keys revoke gpu-box"))
def revoke_key(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The name of the key.", show_default=False)],
    directory: KeysOption = Path("keys"),
) -> None:
    """Revoke a key: here at once, on other machines once allowed.json is copied there."""
    keys.revoke_key(directory, name)


def _run_setup(module: str, *arguments: str) -> None:
    with stop_on_signals() as stop:
        code = run_setup(module, *arguments, stop=stop)
    raise typer.Exit(code)
