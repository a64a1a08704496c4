"""A configuration as a rehearsal runs it: what no result depends on is set so that every fault can happen soon."""

from msgspec.structs import replace

from orchestrator.chaos.schedule import steps_to_a_checkpoint
from protocol.config import RunConfig, TimeoutsConfig

CALL, PROGRESS = 20.0, 28.0
"""A reply that is later than its deadline must not be so late that its worker is taken for hung."""
HEARTBEAT = 2.0
"""Long enough for a worker to be killed, started again and to answer between two pings."""
RESTARTS = 100
"""Within a minute: the budget is for crashes that nobody ordered."""


def rehearsal_config(config: RunConfig, faults: int, steps: int) -> RunConfig:
    """The configuration for a run under so many faults, of so many steps in all.

    Another rhythm of pings, deadlines, checkpoints and restarts: none of them changes what a training comes to, which
    the comparison with a run that was flown without them shows as well.
    """
    # A death at a checkpoint waits for one.
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
