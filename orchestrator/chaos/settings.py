"""The configuration of a rehearsal: settings that change no result are set so that every fault can happen soon."""

from msgspec.structs import replace

from orchestrator.chaos.schedule import steps_to_a_checkpoint
from protocol.config import RunConfig, TimeoutsConfig

CALL, PROGRESS = 20.0, 28.0
"""A late reply must not be so late that its worker counts as hung."""
HEARTBEAT = 2.0
"""Long enough for a worker to be killed, restarted and to answer between two pings."""
RESTARTS = 100
"""Within a minute: the budget is meant for crashes outside a rehearsal."""


def rehearsal_config(config: RunConfig, faults: int, steps: int) -> RunConfig:
    """The configuration for a run of so many steps under so many faults.

    It has other intervals of pings, deadlines, checkpoints and restarts. None of them changes the result of a training,
    which the comparison with the control run confirms.
    """
    # A kill at a checkpoint waits for the next one.
    every = min(config.training.checkpoint_every, steps_to_a_checkpoint(faults, steps))
    return replace(
        config,
        timeouts=rehearsal_timeouts(config.timeouts),
        supervision=replace(config.supervision, max_restarts=max(config.supervision.max_restarts, RESTARTS)),
        training=replace(config.training, checkpoint_every=every),
    )


def rehearsal_timeouts(timeouts: TimeoutsConfig) -> TimeoutsConfig:
    """The clocks of a run under faults."""
    return replace(timeouts, call=CALL, progress=PROGRESS, heartbeat=HEARTBEAT)
