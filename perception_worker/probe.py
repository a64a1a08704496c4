"""`python -m perception_worker.probe` tells whether a perception worker runs here; `orchestrator doctor` calls it."""

import sys

from perception_worker.networks.backend import network_name
from perception_worker.worker import open_perceiver, warm_up, with_lifter_at_hand
from protocol.config import RunConfig, settled
from protocol.system.command import run_command


def main() -> int:
    """Open what a worker with default settings opens, and perceive a picture; returns the exit code."""
    return run_command(_perceive)


def _perceive() -> None:
    config = RunConfig()
    perception = with_lifter_at_hand(settled(config.perception, config.profile))
    warm_up(open_perceiver(perception))
    sys.stdout.write(f"{network_name(perception)} perceives pictures\n")


if __name__ == "__main__":
    sys.exit(main())
