"""The agent's two jobs in a run directory: to train, and to evaluate what was trained."""

import logging
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from agent.checkpointing.journal import Journal, write_record
from agent.checkpointing.resume import open_training
from agent.checkpointing.weights import FILE_NAME, load_weights
from agent.connections import Connections, WorkerAccess
from agent.environment.grid.vector_grid import VectorGrid
from agent.environment.sensor import Sensor
from agent.environment.vector_hover import VectorHover
from agent.evaluation import evaluate
from agent.evaluation_progress import EvaluationProgress, EvaluationStopped
from agent.grid_episodes import write_walks
from agent.grid_evaluation import EvaluatedOnGrid, open_run_on_grid
from agent.learning.algorithms import make_learner
from agent.learning.policies import BASELINES, Policy, baseline, learned
from agent.logbook import Clocks
from agent.telemetry import agent_telemetry
from protocol.artifact import checksum_if_there
from protocol.config import RunConfig
from protocol.config_file import load_run_config, require_recorded_files
from protocol.errors import CallFailed, InvalidInput
from protocol.failpoint import Failpoint, no_failpoint
from protocol.messages import Role
from protocol.records import Evaluation, Summary
from protocol.system.signals import ENDING
from protocol.system.stop_request import StopRequest, stop_on_signals
from protocol.telemetry.endpoint import Endpoint
from protocol.telemetry.info import About

_log = logging.getLogger(__name__)

_CLOCKS = Clocks(wall=time.time, steady=time.monotonic)


def train_run(
    run: Path, workers: WorkerAccess, failpoint: Failpoint = no_failpoint, *, http: Endpoint | None = None
) -> Summary | None:
    """Train as the run's configuration says, from its newest checkpoint on if there is one; None if stopped before.

    Records, curves, checkpoints and weights go into the run directory; health and metrics are served at `http`.

    Raises:
        InvalidConfig: see `protocol.errors`.
        ResumeRefused, RunInUse: see `agent.errors`; nothing was changed.
        DeadlineExceeded, CallFailed: the workers are gone; the flown steps are kept.
    """
    config = _config_of(run)
    learner = make_learner(config.learner, config.grid if config.is_grid else config.flown, seed=config.seed)
    with stop_on_signals(ENDING, once=True) as stop, Connections(config, workers, stop.ask) as connections:
        env = _environment(config, connections)
        about = _about("training", config, workers)
        with (
            agent_telemetry(http, about, connections, run / "checkpoints", lambda: learner.updates) as observer,
            open_training(
                run,
                config,
                env=env,
                learner=learner,
                clocks=_CLOCKS,
                stop=lambda: stop.is_asked,
                failpoint=failpoint,
                observer=observer,
            ) as training,
        ):
            if not config.is_grid and not _ready(connections, stop):
                return None
            summary = training.run(connections.statistics)
    _log.info("trained %d steps at %.1f a second", summary.steps, summary.steps_per_second)
    return summary


def evaluate_run(
    run: Path, workers: WorkerAccess, *, episodes: int | None, names: Sequence[str], http: Endpoint | None = None
) -> Evaluation | None:
    """Evaluate the run's policy and baselines, or those named, and write `evaluation.json`; None if stopped before.

    Of a run on the grid, `grid.json` is written as well. Health and metrics are served at `http`.

    Raises:
        InvalidInput: no policy has that name, or a number of episodes is given of a run on the grid, where every start
            is walked.
        ArtifactMissing, ArtifactDamaged: there are no weights, or they don't fit the configuration.
    """
    config = _config_of(run)
    weights = checksum_if_there(run / FILE_NAME)
    job = (_grid_job if config.is_grid else _flights)(run, config, episodes, names or config.policies)
    about = _about("evaluation", config, workers)
    with (
        stop_on_signals(ENDING, once=True) as stop,
        Connections(config, workers, stop.ask) as connections,
        agent_telemetry(http, about, connections, run / "checkpoints") as observer,
        Journal(run, on_progress=observer.progress) as journal,
    ):
        if not config.is_grid and not _ready(connections, stop):
            return None
        progress = EvaluationProgress(journal, job.steps, _CLOCKS, lambda: stop.is_asked)
        try:
            evaluated = job.evaluate(connections.sensor, progress)
        except (EvaluationStopped, CallFailed):
            # When the whole run ends, the workers may end before the agent.
            if not stop.is_asked:
                raise
            _log.info("stopped on request, before the evaluation was whole")
            return None
        return _written(run, evaluated, weights, connections.incarnation)


class _EvaluationJob(Struct, frozen=True, eq=False):
    """What an evaluation does, and the most steps that it takes."""

    steps: int
    evaluate: Callable[[Sensor, EvaluationProgress], Evaluation | EvaluatedOnGrid]


def _flights(run: Path, config: RunConfig, episodes: int | None, names: Sequence[str]) -> _EvaluationJob:
    policies = _policies(run, config, names)
    flights = config.evaluation.episodes if episodes is None else episodes
    return _EvaluationJob(
        steps=len(policies) * flights * config.flown.episode_steps,
        evaluate=lambda sensor, progress: evaluate(sensor, config, policies, flights, progress),
    )


def _grid_job(run: Path, config: RunConfig, episodes: int | None, names: Sequence[str]) -> _EvaluationJob:
    if episodes is not None:
        raise InvalidInput("--episodes: the evaluation of a run on the grid walks every start in every environment")
    evaluation = open_run_on_grid(run, config, names)
    return _EvaluationJob(steps=evaluation.steps, evaluate=lambda _sensor, progress: evaluation.walk(progress))


def _written(run: Path, evaluated: Evaluation | EvaluatedOnGrid, weights: str | None, incarnation: str) -> Evaluation:
    """The evaluation, after it was written; of a grid, its details first, so that they are there once it is."""
    if isinstance(evaluated, EvaluatedOnGrid):
        details = replace(evaluated.details, weights=weights, by=incarnation)
        write_walks(run / "walks.npz", evaluated.walks, details.thresholds[0].threshold)
        write_record(run / "grid.json", details)
        evaluated = evaluated.evaluation
    evaluation = replace(evaluated, weights=weights, by=incarnation)
    write_record(run / "evaluation.json", evaluation)
    return evaluation


def _config_of(run: Path) -> RunConfig:
    """The run's configuration; errors as `load_run_config`, and `OtherArtifact` where its grid table has changed."""
    config = load_run_config(run)
    require_recorded_files(config, "grid.")
    return config


def _environment(config: RunConfig, connections: Connections) -> VectorHover | VectorGrid:
    if config.is_grid:
        return VectorGrid(config=config.grid, curriculum=True)
    return VectorHover(connections.sensor, config=config.flown)


def _about(job: str, config: RunConfig, workers: WorkerAccess) -> About:
    name = job if workers.registration is None else workers.registration.name
    capabilities = {"job": job, "algorithm": config.learner.algorithm}
    return About(role=Role.AGENT, name=name, capabilities=capabilities)


def _ready(connections: Connections, stop: StopRequest) -> bool:
    """Whether there are workers; False if a stop was requested while there were none."""
    try:
        connections.wait_ready()
    except CallFailed:
        if not stop.is_asked:
            raise
        _log.info("stopped on request, before there were workers")
        return False
    return True


def _policies(run: Path, config: RunConfig, names: Sequence[str]) -> dict[str, Policy]:
    policies: dict[str, Policy] = {}
    for name in names:
        if name in BASELINES:
            policies[name] = baseline(name, config.flown)
        elif name == config.learner.algorithm:
            policies[name] = _trained(run, config)
        else:
            known = ", ".join((config.learner.algorithm, *BASELINES))
            raise InvalidInput(f"there is no policy '{name}' in this run; there are {known}")
    return policies


def _trained(run: Path, config: RunConfig) -> Policy:
    learner = make_learner(config.learner, config.flown, seed=config.seed)
    weights, about = load_weights(run / FILE_NAME)
    learner.load_weights(weights)
    _log.info("flying weights of %s steps", about.get("steps", "unknown"))
    return learned(learner)
