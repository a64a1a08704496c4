"""`python -m agent train` and `python -m agent evaluate`: the agent as a process of a run."""

import argparse
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from agent.commands import evaluate_run, train_run
from agent.connections import WorkerAccess
from protocol.errors import VantageError
from protocol.failpoint import failpoint_of
from protocol.security.options import add_security_options, security_of
from protocol.server.registration_settings import RegistrationSettings
from protocol.system import logs
from protocol.system.exit_code import ExitCode, logged_exit_code_of
from protocol.telemetry.endpoint import add_http_options, endpoint_of

_log = logging.getLogger("agent")


def main(arguments: Sequence[str] | None = None) -> int:
    """Do one of the agent's jobs, and say with the exit code how it ended: see `protocol.system.exit_code`."""
    parser = _parser()
    options = parser.parse_args(arguments)
    logs.configure("agent")
    try:
        workers, http = _workers(options, parser), endpoint_of(options, os.environ)
        if options.job == "train":
            train_run(options.run, workers, failpoint_of(os.environ), http=http)
        else:
            evaluate_run(options.run, workers, episodes=options.episodes, names=options.policy, http=http)
    except (VantageError, OSError) as error:
        return logged_exit_code_of(error, _log)
    return ExitCode.DONE


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m agent", description="Learns where to fly.")
    jobs = parser.add_subparsers(dest="job", required=True)
    train = jobs.add_parser("train", help="train as the run's config.toml says, or go on with it")
    evaluate = jobs.add_parser("evaluate", help="let the trained policy and the baselines fly on test scenes")
    for job in (train, evaluate):
        job.add_argument("--run", type=Path, required=True, help="the run directory")
        job.add_argument("--render", action="append", default=[], help="address of a render worker; may be repeated")
        job.add_argument("--perception", action="append", default=[], help="of a perception worker; likewise")
        job.add_argument("--orchestrator", help="where to register, and to learn of workers")
        add_security_options(job)
        job.add_argument("--name", default="", help="what the orchestrator calls this process")
        add_http_options(job)
    evaluate.add_argument("--episodes", type=_count, help="flights of each policy, instead of the configured number")
    evaluate.add_argument("--policy", action="append", default=[], help="which to fly, instead of all; may be repeated")
    return parser


def _workers(options: argparse.Namespace, parser: argparse.ArgumentParser) -> WorkerAccess:
    if options.orchestrator is None and not (options.render and options.perception):
        parser.error("without --orchestrator, --render and --perception are required")
    registration = None
    if options.orchestrator is not None:
        registration = RegistrationSettings(options.orchestrator, options.name or options.job)
    return WorkerAccess(
        render=tuple(options.render),
        perception=tuple(options.perception),
        registration=registration,
        security=security_of(options, os.environ),
    )


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of flights")
    return int(text)


if __name__ == "__main__":
    sys.exit(main())
