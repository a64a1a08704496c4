"""Trainings in processes of their own, ended by SIGKILL at a place that is chosen."""

import itertools
import multiprocessing
import os
import signal
from functools import cache
from pathlib import Path

from protocol.client.pending import Pending
from protocol.config import RunConfig
from protocol.failpoint import Failpoints, no_failpoint
from tests.agent.analytic_sensor import TIMING, AnalyticSensor
from tests.agent.trainings import trained


def train_until(run: Path, config: RunConfig, *, look: int | None = None, failpoints: Path | None = None) -> int:
    """Train in another process, which is killed at its picture number `look`, or at a failpoint; its exit code."""
    process = _processes().Process(target=_train, args=(run, config, look, failpoints))
    process.start()
    process.join(60)
    assert process.exitcode is not None
    return process.exitcode


@cache
def _processes() -> multiprocessing.context.ForkServerContext:
    """Copies of one process that has all modules loaded, so that each starts at once and without threads."""
    context = multiprocessing.get_context("forkserver")
    # The last one is what torch loads with the first optimiser, in seconds.
    modules = [
        "agent.learning.ppo",
        "agent.learning.sac",
        "tests.agent.trainings",
        "torch.utils.tensorboard.writer",
        "torch._dynamo",
    ]
    context.set_forkserver_preload(modules)
    return context


def _train(run: Path, config: RunConfig, look: int | None, failpoints: Path | None) -> None:
    looks = itertools.count(1)

    def deliver(pending: Pending, observation: object) -> None:
        if next(looks) == look:
            os.kill(os.getpid(), signal.SIGKILL)
        pending.succeed(observation, TIMING)

    reach = Failpoints(failpoints).reach if failpoints else no_failpoint
    trained(run, config, sensor=AnalyticSensor(deliver), failpoint=reach)
