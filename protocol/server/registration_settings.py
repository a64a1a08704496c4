"""What a process needs to know to register with an orchestrator, and the command line's options for it."""

import argparse
from collections.abc import Mapping
from typing import NamedTuple

from protocol.client.pool import Pool
from protocol.messages import Role


class RegistrationSettings(NamedTuple):
    """The orchestrator to register with, and what to register.

    Attributes:
        orchestrator: its address.
        name: what the run calls this process, such as `render-0`.
        follows: pools whose addresses are kept as the orchestrator's table has them, by the role of their workers.
        advertised: where other processes reach this one, if not at the address that it binds.
    """

    orchestrator: str
    name: str
    follows: Mapping[Role, Pool] = {}
    advertised: str | None = None


ADVERTISE_HELP = "where others reach it, if not at --bind (default for a bind to every interface: this host's name)"


def registration_of(options: argparse.Namespace) -> RegistrationSettings | None:
    """The settings in a worker's options `--orchestrator`, `--name` and `--advertise`; None without an orchestrator."""
    if options.orchestrator is None:
        return None
    return RegistrationSettings(options.orchestrator, options.name, advertised=options.advertise)
