"""A training of a run directory: gone on with from its newest checkpoint, or begun where there is none.

What a checkpoint needs is checked first, all of it. Only then is anything changed: what came after it is cut off.
"""

from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from agent.checkpointing.checkpoint import REPLAY, Checkpoint
from agent.checkpointing.checkpoints import Checkpoints
from agent.checkpointing.journal import Journal
from agent.checkpointing.replay_journal import ReplayJournal
from agent.checkpointing.run_lock import sole_training
from agent.environment.vector_hover import VectorHover
from agent.learning.learner import Learner
from agent.logbook import Clocks
from agent.observer import NOBODY, Observer
from agent.training import Records, Training
from protocol.config import RunConfig
from protocol.failpoint import Failpoint, no_failpoint


@contextmanager
def open_training(
    run: Path,
    config: RunConfig,
    *,
    env: VectorHover,
    learner: Learner,
    clocks: Clocks,
    stop: Callable[[], bool],
    failpoint: Failpoint = no_failpoint,
    observer: Observer = NOBODY,
) -> Generator[Training]:
    """A training where it was left.

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
        replay = _open_replay(run, config, newest, opened) if learner.off_policy else None
        journal = opened.enter_context(_open_journal(run, newest, observer))
        records = Records(run=run, journal=journal, replay=replay, checkpoints=checkpoints)
        training = Training(
            config,
            env=env,
            learner=learner,
            records=records,
            clocks=clocks,
            stop=stop,
            failpoint=failpoint,
            observer=observer,
        )
        if newest is not None:
            training.restore(newest)
        yield training


def _open_journal(run: Path, newest: Checkpoint | None, observer: Observer) -> Journal:
    """Cut back to what the checkpoint names; to nothing where there is none."""
    episodes, flown = (newest.manifest.grown.episodes.length, newest.manifest.step) if newest else (0, 0)
    return Journal(run, episodes=episodes, flown=flown, on_progress=observer.progress)


def _open_replay(run: Path, config: RunConfig, newest: Checkpoint | None, opened: ExitStack) -> ReplayJournal:
    """Cut back likewise."""
    segments = newest.manifest.grown.replay if newest else ()
    return opened.enter_context(ReplayJournal(run / REPLAY, config.environment.num_envs, segments))
