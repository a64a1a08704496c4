"""`python -m perception_worker.probe`: whether a perception worker would work here. `orchestrator doctor` runs it."""

import sys

from perception_worker.networks.backend import network_name
from perception_worker.worker import open_perceiver, warm_up, with_lifter_at_hand
from protocol.config import RunConfig, settled
from protocol.system.command import run_command


def main() -> int:
    """Open what a worker opens that is told nothing, and look at a picture; returns the exit code."""
    return run_command(_look)


def _look() -> None:
    config = RunConfig()
    perception = with_lifter_at_hand(settled(config.perception, config.profile))
    warm_up(open_perceiver(perception))
    sys.stdout.write(f"{network_name(perception)} looks at pictures\n")


if __name__ == "__main__":
    sys.exit(main())
