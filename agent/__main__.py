"""`python -m agent train` and `python -m agent evaluate`: the agent as a process of a run."""

import argparse
import logging
import sys
from collections.abc import Sequence
from pathlib import Path

from agent.commands import Workers, evaluate_run, train_run
from protocol import logs
from protocol.errors import VantageError

_log = logging.getLogger("agent")


def main(arguments: Sequence[str] | None = None) -> int:
    """Do one of the agent's jobs; 0 when it is done or was stopped on request, 2 when it can't be done."""
    options = _parser().parse_args(arguments)
    logs.configure("agent")
    workers = Workers(render=tuple(options.render), perception=tuple(options.perception))
    try:
        if options.job == "train":
            train_run(options.run, workers)
        else:
            evaluate_run(options.run, workers, episodes=options.episodes, names=options.policy)
    except VantageError as error:
        _log.error("%s", error, extra={"error": type(error).__name__})
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m agent", description="Learns where to fly.")
    jobs = parser.add_subparsers(dest="job", required=True)
    train = jobs.add_parser("train", help="train as the run's config.toml says")
    evaluate = jobs.add_parser("evaluate", help="let the trained policy and the baselines fly on test scenes")
    for job in (train, evaluate):
        job.add_argument("--run", type=Path, required=True, help="the run directory")
        job.add_argument("--render", action="append", required=True, help="address of a render worker; may be repeated")
        job.add_argument("--perception", action="append", required=True, help="of a perception worker; likewise")
    evaluate.add_argument("--episodes", type=_count, help="flights of each policy, instead of the configured number")
    evaluate.add_argument("--policy", action="append", default=[], help="which to fly, instead of all; may be repeated")
    return parser


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of flights")
    return int(text)


if __name__ == "__main__":
    sys.exit(main())
