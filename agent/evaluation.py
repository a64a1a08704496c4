"""Evaluation of policies, all on the same scenes of test identities and from the same starts."""

from collections.abc import Callable, Iterator, Mapping, Sequence

from gymnasium.vector import AutoresetMode

from agent.environment.flight import Flight
from agent.environment.hover_task import HoverTask
from agent.environment.sensor import Sensor
from agent.environment.vector_hover import VectorHover
from agent.environment.versions import hover_task
from agent.intervals import mean_interval, rate_interval
from agent.learning.policies import Policy
from protocol.config import RunConfig
from protocol.environment_config import EnvironmentConfig
from protocol.records import Evaluation, PolicyScore


def evaluate(
    sensor: Sensor, config: RunConfig, policies: Mapping[str, Policy], episodes: int, on_step: Callable[[int], None]
) -> Evaluation:
    """Let each policy fly the episodes of the seeds from `first_seed` on.

    Args:
        on_step: called after each step with the number of environment steps in it; may raise to stop.
    """
    first = config.evaluation.first_seed
    seeds = range(first, first + episodes)
    task = hover_task(config.flown)
    scores = [
        score(name, list(fly(sensor, config.flown, policy, seeds, on_step)), task) for name, policy in policies.items()
    ]
    return Evaluation(
        first_seed=first,
        success_threshold=task.success_threshold,
        scores=tuple(scores),
        in_metres=task.in_metres,
    )


def fly(
    sensor: Sensor, config: EnvironmentConfig, policy: Policy, seeds: Sequence[int], on_step: Callable[[int], None]
) -> Iterator[Flight]:
    """The finished flights of the seeds, in their order; `num_envs` at a time."""
    for first in range(0, len(seeds), config.num_envs):
        wave = seeds[first : first + config.num_envs]
        env = VectorHover(sensor, len(wave), config, split="test", autoreset_mode=AutoresetMode.DISABLED)
        observations, _ = env.reset(seed=wave)
        while not all(flight.over for flight in env.flights):
            observations, *_ = env.step(policy(observations, env.flights))
            on_step(len(wave))
        yield from env.flights


def score(policy: str, flights: Sequence[Flight], task: HoverTask) -> PolicyScore:
    """The scores of one or more finished flights of a policy, with 95% intervals."""
    successes = sum(task.succeeded(flight) for flight in flights)
    return PolicyScore(
        policy=policy,
        episodes=len(flights),
        total_reward=mean_interval([flight.total_reward for flight in flights]),
        uncertainty=mean_interval([task.uncertainty(flight) for flight in flights]),
        success=rate_interval(successes, len(flights)),
        crash=rate_interval(sum(flight.ended_badly for flight in flights), len(flights)),
        length=mean_interval([flight.steps for flight in flights]),
    )
