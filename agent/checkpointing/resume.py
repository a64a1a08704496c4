"""The training of a run directory: resumed from its newest checkpoint, or begun where there is none.

Everything a checkpoint needs is checked first. Only then is anything changed: records after the checkpoint are cut off.
"""

from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from agent.checkpointing.checkpoint import REPLAY, Checkpoint
from agent.checkpointing.checkpoints import Checkpoints
from agent.checkpointing.journal import Journal
from agent.checkpointing.replay_journal import ReplayJournal
from agent.checkpointing.run_lock import sole_training
from agent.environment.grid.vector_grid import VectorGrid
from agent.environment.vector_hover import VectorHover
from agent.environment.versions import hover_task
from agent.learning.learner import Learner
from agent.logbook import Clocks
from agent.observer import NO_OBSERVER, Observer
from agent.training import Records, Training
from protocol.config import RunConfig
from protocol.failpoint import Failpoint, no_failpoint


@contextmanager
def open_training(
    run: Path,
    config: RunConfig,
    *,
    env: VectorHover | VectorGrid,
    learner: Learner,
    clocks: Clocks,
    stop: Callable[[], bool],
    failpoint: Failpoint = no_failpoint,
    observer: Observer = NO_OBSERVER,
) -> Generator[Training]:
    """The training of a run, where it was left.

    Raises:
        ResumeRefused, RunInUse: see `agent.errors`; nothing was changed.
    """
    with ExitStack() as opened:
        opened.enter_context(sole_training(run / "checkpoints"))
        checkpoints = Checkpoints(run / "checkpoints", config, failpoint)
        newest = checkpoints.newest()
        if newest is not None:
            newest.require_grown(run)
        checkpoints.tidy(newest)
        replay = None
        if learner.off_policy:
            replay = opened.enter_context(_open_replay(run, config, newest))
        journal = opened.enter_context(_open_journal(run, newest, observer))
        training = Training(
            config,
            env=env,
            learner=learner,
            records=Records(run=run, journal=journal, replay=replay, checkpoints=checkpoints),
            clocks=clocks,
            stop=stop,
            failpoint=failpoint,
            observer=observer,
        )
        if newest is not None:
            training.restore(newest)
        yield training


def _open_journal(run: Path, newest: Checkpoint | None, observer: Observer) -> Journal:
    """The journal, cut back to the checkpoint, or emptied where there is none."""
    episodes, flown = (newest.manifest.grown.episodes.length, newest.manifest.step) if newest else (0, 0)
    return Journal(run, episodes=episodes, flown=flown, on_progress=observer.progress)


def _open_replay(run: Path, config: RunConfig, newest: Checkpoint | None) -> ReplayJournal:
    """The replay journal, cut back likewise."""
    segments = newest.manifest.grown.replay if newest else ()
    (size,) = hover_task(config.flown).observation_space().shape
    return ReplayJournal(run / REPLAY, config.num_envs, size, segments)
