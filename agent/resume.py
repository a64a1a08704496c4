"""A training of a run directory: gone on with from its newest checkpoint, or begun where there is none.

What a checkpoint needs is checked first, all of it. Only then is anything changed: what came after it is cut off.
"""

from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from agent.checkpoint import REPLAY, Checkpoint
from agent.checkpoints import Checkpoints
from agent.journal import Journal
from agent.learner import Learner
from agent.logbook import Clocks
from agent.replay_journal import ReplayJournal
from agent.run_lock import sole_training
from agent.training import Records, Training
from agent.vector_hover import VectorHover
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
        records = _open_records(run, config, checkpoints, newest, opened, off_policy=learner.off_policy)
        training = Training(config, env=env, learner=learner, records=records, clocks=clocks, stop=stop)
        if newest is not None:
            training.restore(newest)
        yield training


def _open_records(
    run: Path,
    config: RunConfig,
    checkpoints: Checkpoints,
    newest: Checkpoint | None,
    opened: ExitStack,
    *,
    off_policy: bool,
) -> Records:
    """Cut back what grows to what the checkpoint names; to nothing where there is none."""
    manifest = newest and newest.manifest
    journal = Journal(
        run, episodes=manifest.grown.episodes.length if manifest else 0, flown=manifest.step if manifest else 0
    )
    replay = None
    if off_policy:
        segments = manifest.grown.replay if manifest else ()
        replay = opened.enter_context(ReplayJournal(run / REPLAY, config.environment.num_envs, segments))
    return Records(run=run, journal=opened.enter_context(journal), replay=replay, checkpoints=checkpoints)
