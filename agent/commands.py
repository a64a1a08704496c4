"""The agent's two jobs in a run directory: to train, and to evaluate what was trained."""

import logging
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from msgspec import Struct

from agent.evaluation import evaluate
from agent.eyes import Eyes, RemoteEyes
from agent.journal import Journal, write_record
from agent.learner import make_learner
from agent.logbook import PROGRESS_EVERY, Clocks
from agent.pace import Pace
from agent.policies import BASELINES, Policy, baseline, learned
from agent.stopping import stop_on_signals
from agent.training import Training
from agent.vector_hover import VectorHover
from agent.weights import FILE_NAME, load_weights
from protocol.config import RunConfig, load_config
from protocol.dispatcher import Statistics
from protocol.errors import InvalidInput
from protocol.messages import Role
from protocol.pool import Pool
from protocol.priority import let_others_go_first
from protocol.records import Evaluation, Progress, Summary
from protocol.timeouts import Timeouts

_log = logging.getLogger(__name__)

_CLOCKS = Clocks(wall=time.time, steady=time.monotonic)


class Workers(Struct, frozen=True):
    """Where the workers of a run serve."""

    render: tuple[str, ...]
    perception: tuple[str, ...]


class EvaluationStopped(Exception):
    """Somebody asked to stop before the last flight was over."""


def train_run(run: Path, workers: Workers) -> Summary:
    """Train as the run's configuration says; records, curves and weights go into the run directory.

    Raises:
        InvalidConfig, DeadlineExceeded, CallFailed: see `protocol.errors`; weights written before then stay.
    """
    config = load_config(run / "config.toml")
    learner = make_learner(config.learner, config.environment, seed=config.seed)
    with _eyes(config, workers) as (eyes, calls), Journal(run) as journal, stop_on_signals() as stop:
        env = VectorHover(eyes, config=config.environment)
        training = Training(run, config, env=env, learner=learner, journal=journal, clocks=_CLOCKS, stop=stop)
        summary = training.run(calls)
    _log.info("trained %d steps at %.1f a second", summary.steps, summary.steps_per_second)
    return summary


def evaluate_run(run: Path, workers: Workers, *, episodes: int | None, names: Sequence[str]) -> Evaluation | None:
    """Evaluate the run's policy and baselines, or those named, and write `evaluation.json`; None if stopped before.

    Raises:
        InvalidInput: there is no policy of that name.
        ArtifactMissing, ArtifactDamaged: there are no weights, or they don't fit the configuration.
    """
    config = load_config(run / "config.toml")
    policies = _policies(run, config, names or (config.learner.algorithm, *config.evaluation.baselines))
    flights = config.evaluation.episodes if episodes is None else episodes
    with _eyes(config, workers) as (eyes, _), Journal(run) as journal, stop_on_signals() as stop:
        watch = EvaluationWatch(journal, len(policies) * flights * config.environment.episode_steps, _CLOCKS, stop)
        try:
            evaluation = evaluate(eyes, config, policies, flights, watch)
        except EvaluationStopped:
            _log.info("stopped on request, before the evaluation was whole")
            return None
        write_record(run / "evaluation.json", evaluation)
    return evaluation


class EvaluationWatch:
    """Writes down how far an evaluation is, and stops it on request."""

    def __init__(self, journal: Journal, steps: int, clocks: Clocks, stop: Callable[[], bool]) -> None:
        self._journal = journal
        self._steps = steps
        self._clocks = clocks
        self._stop = stop
        self._step = 0
        self._pace = Pace(clocks.steady)
        self._written = clocks.steady()

    def __call__(self, steps: int) -> None:
        """So many environment steps were flown."""
        if self._stop():
            raise EvaluationStopped
        self._step += steps
        self._pace.reached(self._step)
        if self._clocks.steady() - self._written >= PROGRESS_EVERY:
            self._written = self._clocks.steady()
            self._journal.progress(
                Progress(
                    time=self._clocks.wall(),
                    phase="evaluation",
                    step=self._step,
                    steps=self._steps,
                    episodes=0,
                    steps_per_second=self._pace.steps_per_second,
                )
            )


def _policies(run: Path, config: RunConfig, names: Sequence[str]) -> dict[str, Policy]:
    policies: dict[str, Policy] = {}
    for name in names:
        if name in BASELINES:
            policies[name] = baseline(name, config.environment)
        elif name == config.learner.algorithm:
            policies[name] = _trained(run, config)
        else:
            known = ", ".join((config.learner.algorithm, *BASELINES))
            raise InvalidInput(f"there is no policy '{name}' in this run; there are {known}")
    return policies


def _trained(run: Path, config: RunConfig) -> Policy:
    learner = make_learner(config.learner, config.environment, seed=config.seed)
    weights, about = load_weights(run / FILE_NAME)
    learner.load_weights(weights)
    _log.info("flying weights of %s steps", about.get("steps", "unknown"))
    return learned(learner)


@contextmanager
def _eyes(config: RunConfig, workers: Workers) -> Generator[tuple[Eyes, Callable[[], Statistics]]]:
    """Connections to the workers, all of them ready, and what they have counted."""
    timeouts = Timeouts.from_config(config.timeouts)
    with (
        Pool(workers.render, role=Role.AGENT, serves=Role.RENDER, timeouts=timeouts) as render,
        Pool(workers.perception, role=Role.AGENT, serves=Role.PERCEPTION, timeouts=timeouts) as perception,
    ):
        render.wait_ready()
        perception.wait_ready()
        # Only now: the threads of both pools keep theirs, so that an update does not hold up the next pictures.
        let_others_go_first()
        yield RemoteEyes(render, perception), lambda: _sum(render.statistics, perception.statistics)


def _sum(first: Statistics, second: Statistics) -> Statistics:
    names = first.__struct_fields__
    return Statistics(**{name: getattr(first, name) + getattr(second, name) for name in names})
