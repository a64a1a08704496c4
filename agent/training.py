"""The loop: act, send, learn while the pictures are under way, receive, observe.

What is learned in a step comes from the transitions up to the step before, however fast the workers are. So a training
depends on its configuration and its seed alone.
"""

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np

from agent.journal import Journal
from agent.learner import Learner, Transition
from agent.logbook import Clocks, Logbook
from agent.policies import Policy, scripted
from agent.vector_hover import StepResult, VectorHover
from agent.weights import FILE_NAME, save_weights
from protocol.arrays import Float32Array
from protocol.config import RunConfig
from protocol.dispatcher import Statistics as CallStatistics
from protocol.records import Phase, Summary

_log = logging.getLogger(__name__)


class Training:
    """One training of one learner, in a run directory."""

    def __init__(
        self,
        run: Path,
        config: RunConfig,
        *,
        env: VectorHover,
        learner: Learner,
        journal: Journal,
        clocks: Clocks,
        stop: Callable[[], bool],
    ) -> None:
        self._weights = run / FILE_NAME
        self._config = config
        self._env = env
        self._learner = learner
        self._journal = journal
        self._clocks = clocks
        self._stop = stop
        self._logbook = Logbook(journal, config, clocks)
        self._trained = 0

    def run(self, calls: Callable[[], CallStatistics]) -> Summary:
        """Train for as many steps as configured, or until `stop` says so; write the weights and a summary either way.

        Args:
            calls: what the connections to the workers have counted so far.
        """
        training = self._config.training
        observations, _ = self._env.reset(seed=self._config.seed)
        if self._learner.off_policy and training.prefill:
            prefill = scripted(self._config.environment, training.prefill_noise)
            self._fly("prefill", "scripted", prefill, observations, training.prefill)
            observations, _ = self._env.reset()
        begun = self._clocks.steady()
        self._fly("training", self._config.learner.algorithm, self._explore, observations, training.steps)
        summary = self._summary(self._clocks.steady() - begun, calls())
        self._save()
        self._journal.summary(summary)
        self._logbook.begin("done", "", training.steps, done=self._trained)
        self._logbook.write_progress()
        return summary

    def _fly(self, phase: Phase, name: str, policy: Policy, observations: Float32Array, steps: int) -> None:
        """Let a policy fly for at least so many environment steps, and the learner learn from it."""
        _log.info("%s: %d steps", phase, steps)
        self._logbook.begin(phase, name, steps)
        done = 0
        while done < steps and not self._stop():
            observations = self._step(policy, observations)
            done += self._env.num_envs
            if phase == "training":
                self._trained = done
                if done % self._config.training.checkpoint_every < self._env.num_envs:
                    self._save()
        self._logbook.write_progress()

    def _step(self, policy: Policy, observations: Float32Array) -> Float32Array:
        actions = policy(observations, self._env.flights)
        self._env.send(actions)
        begun = self._clocks.steady()
        learned = self._learner.learn()
        learning = self._clocks.steady() - begun
        result = self._env.receive()
        self._learner.observe(transition_of(observations, actions, result))
        self._logbook.enter(self._env.num_envs, result[-1], learned, learning)
        return result[0]

    def _explore(self, observations: Float32Array, flights: object) -> Float32Array:
        return self._learner.act(observations, explore=True)

    def _summary(self, seconds: float, calls: CallStatistics) -> Summary:
        return Summary(
            steps=self._trained,
            episodes=self._logbook.flights.count,
            updates=self._learner.updates,
            seconds=seconds,
            steps_per_second=self._trained / seconds if seconds > 0 else 0.0,
            stages=self._logbook.stages,
            late_replies=calls.late_replies,
            retries=calls.retries,
        )

    def _save(self) -> None:
        about = {
            "algorithm": self._config.learner.algorithm,
            "run_seed": str(self._config.seed),
            "steps": str(self._trained),
            "updates": str(self._learner.updates),
        }
        save_weights(self._weights, self._learner.weights(), about)


def transition_of(observations: Float32Array, actions: Float32Array, result: StepResult) -> Transition:
    """A step as learners take it; what follows a finished flight is its own last observation."""
    following, rewards, terminated, truncated, infos = result
    following = following.copy()
    for index in np.flatnonzero(terminated | truncated):
        following[index] = infos["final_obs"][index]
    return Transition(
        observations=observations,
        actions=actions,
        rewards=rewards,
        next_observations=following,
        terminated=terminated,
        truncated=truncated,
    )
