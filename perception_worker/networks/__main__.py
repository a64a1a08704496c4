"""`python -m perception_worker.networks pull`, `check` or `list`, each with `--help`."""

import argparse
import logging
import sys
from collections.abc import Sequence

import msgspec

from perception_worker.networks.models import DEFAULTS, KNOWN, pull, require_network
from perception_worker.networks.published_network import PublishedNetwork
from protocol.errors import ArtifactError, ArtifactMissing, InvalidInput
from protocol.system.command import run_command

_logger = logging.getLogger(__name__)


class Listed(msgspec.Struct, frozen=True):
    """How a network known by name is kept here.

    Attributes:
        state: `whole`, `missing` or `damaged`.
        megabytes: to fetch.
    """

    name: str
    state: str
    default: bool
    package: str
    megabytes: int


def listed(network: PublishedNetwork) -> Listed:
    """How a network is kept here."""
    try:
        require_network(network)
        state = "whole"
    except ArtifactMissing:
        state = "missing"
    except ArtifactError:
        state = "damaged"
    return Listed(network.name, state, network in DEFAULTS, network.package, network.megabytes)


def main(arguments: Sequence[str] | None = None) -> int:
    """Do one of the commands; returns the exit code."""
    chosen = _parser().parse_args(arguments)
    return run_command(lambda: _list(as_json=chosen.json) if chosen.command == "list" else _make_ready(chosen))


def _make_ready(chosen: argparse.Namespace) -> None:
    networks = _chosen(chosen.names, every=getattr(chosen, "all", False))
    made = pull(*networks, force=chosen.force) if chosen.command == "pull" else []
    for network in networks:
        path = require_network(network)
        _logger.info("%s is %s: %s", network.name, "ready" if network in made else "already there and whole", path)


def _chosen(names: Sequence[str], *, every: bool) -> list[PublishedNetwork]:
    if every and names:
        raise InvalidInput(f"either --all or names, not both: {', '.join(names)}")
    return list(KNOWN.values()) if every else _named(names)


def _named(names: Sequence[str]) -> list[PublishedNetwork]:
    if unknown := [name for name in names if name not in KNOWN]:
        raise InvalidInput(f"there is no network {unknown[0]}; known are {', '.join(KNOWN)}")
    return [KNOWN[name] for name in names] or list(DEFAULTS)


def _list(*, as_json: bool) -> None:
    networks = [listed(network) for network in KNOWN.values()]
    if as_json:
        sys.stdout.write(msgspec.json.encode(networks).decode() + "\n")
        return
    for network in networks:
        default = ", a default" if network.default else ""
        sys.stdout.write(f"{network.name}: {network.state}{default} ({network.package}, {network.megabytes} MB)\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m perception_worker.networks", description="The pose networks known by name."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    pulling = commands.add_parser("pull", help="put networks into the user's cache, unless they are there and whole")
    pulling.add_argument("--all", action="store_true", help="every network known by name")
    pulling.add_argument("--force", action="store_true", help="make them anew")
    checking = commands.add_parser("check", help="say whether networks are there and whole")
    for command in (pulling, checking):
        command.add_argument("names", nargs="*", metavar="NAME", help="which; without one, the default networks")
    listing = commands.add_parser("list", help="say which there are, and how each is kept here")
    listing.add_argument("--json", action="store_true", help="for programs")
    return parser


if __name__ == "__main__":
    sys.exit(main())
