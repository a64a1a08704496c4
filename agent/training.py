"""The training loop: learn while the estimates of a step are under way, receive some, act on them, send, observe.

A step learns from the transitions up to the step before, however fast the workers are. So a training depends on its
configuration and its seed alone; and between two steps, it depends on its state alone.

Off policy, the drones fly on in two groups: one waits for its estimates while the other's are made. So the workers are
busy while the agent acts, writes its records and begins to learn. On policy, an action's step must be observed before
the next action is chosen, so all drones wait for each other.
"""

import logging
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from agent.call_counts import total
from agent.checkpointing.checkpoint import Checkpoint, Content, Grown
from agent.checkpointing.checkpoints import Checkpoints
from agent.checkpointing.journal import Journal
from agent.checkpointing.replay_journal import ReplayJournal
from agent.checkpointing.weights import FILE_NAME, save_weights
from agent.environment.grid.vector_grid import VectorGrid
from agent.environment.spaces import ACTION_SIZE
from agent.environment.vector_hover import StepResult, VectorHover
from agent.flight_log import SCRIPTED
from agent.learning.learner import ActionArray, Learner, Transition
from agent.learning.learner import Statistics as Losses
from agent.learning.policies import Policy, scripted
from agent.logbook import Clocks, Logbook
from agent.observer import NO_OBSERVER, Observer
from protocol.arrays import Float32Array
from protocol.client.dispatcher import Statistics as CallStatistics
from protocol.config import RunConfig
from protocol.errors import CallFailed
from protocol.failpoint import Failpoint, no_failpoint
from protocol.records import Phase, Summary

_log = logging.getLogger(__name__)

_TRIES = 10
"""Number of times that a failed checkpoint is tried again before the next one is due."""


class Records(Struct, frozen=True, eq=False, kw_only=True):
    """The files that a training writes; `replay` is None where the learner has no replay memory."""

    run: Path
    journal: Journal
    replay: ReplayJournal | None
    checkpoints: Checkpoints


_GROUPS = 2
"""Groups of drones that fly on together, off policy. A training's result depends on it: each group draws its noise."""


class _PendingStep(Struct, frozen=True, eq=False):
    """A step that was begun.

    Attributes:
        actions: of the step.
        learned: the losses, once the step was learned in.
        learning: seconds that learning took.
        ahead: actions of the first drones in the next step, as far as they were chosen.
    """

    actions: ActionArray
    learned: Losses | None = None
    learning: float = 0.0
    ahead: ActionArray | None = None


class Training:
    """One training of one learner, in a run directory.

    Args:
        failpoint: reached at `step-N` before each step, where N environment steps were flown, over all phases.
    """

    def __init__(
        self,
        config: RunConfig,
        *,
        env: VectorHover | VectorGrid,
        learner: Learner,
        records: Records,
        clocks: Clocks,
        stop: Callable[[], bool],
        failpoint: Failpoint = no_failpoint,
        observer: Observer = NO_OBSERVER,
    ) -> None:
        self._config = config
        self._reach = failpoint
        self._observer = observer
        self._env = env
        self._learner = learner
        self._records = records
        self._clocks = clocks
        self._stop = stop
        self._groups = _groups(env.num_envs, _GROUPS if learner.off_policy else 1)
        self._logbook = Logbook(records.journal, config, clocks)
        self._phase: Phase = "prefill" if learner.off_policy and config.training.prefill else "training"
        self._done = 0
        self._under_way: _PendingStep | None = None
        self._seconds = 0.0
        self._calls = CallStatistics()
        self._counted: Callable[[], CallStatistics] = CallStatistics
        self._resumed = False
        self._kept: int | None = None
        self._plan_checkpoint()

    def restore(self, checkpoint: Checkpoint) -> None:
        """Resume from a checkpoint to which the journals were cut back."""
        state, measured = checkpoint.state(), checkpoint.measured()
        self._phase, self._done = state["loop"]["phase"], state["loop"]["done"]
        self._seconds = measured["seconds"]
        self._calls = msgspec.convert(measured["calls"], CallStatistics)
        if (under_way := state["loop"]["under_way"]) is not None:
            self._under_way = _PendingStep(**under_way)
        self._logbook.restore(state["logbook"], measured["stages"])
        self._env.restore(state["environment"])
        self._learner.load_weights(checkpoint.weights())
        # After everything that might draw: the learner restores the generators of the process.
        self._learner.restore(state["learner"])
        if self._records.replay is not None:
            self._learner.recall(self._records.replay.last(self._learner.memory_steps))
        self._resumed, self._kept = True, self._logbook.flown
        self._plan_checkpoint()
        _log.info("going on after %d steps", self._logbook.flown)

    def run(self, calls: Callable[[], CallStatistics]) -> Summary:
        """Train until all steps are flown, or `stop` is true; write a checkpoint, weights and a summary either way.

        Args:
            calls: returns the counts of the connections to the workers.

        Raises:
            CallFailed: the workers are gone; the flown steps are kept.
        """
        self._counted = calls
        try:
            self._fly_all()
        except CallFailed:
            self._keep()
            if not self._stop():
                raise
        return self._end()

    def _fly_all(self) -> None:
        if not self._resumed:
            self._env.reset(seed=self._config.seed)
        training = self._config.training
        if self._phase == "prefill":
            script = scripted(self._config.flown, training.prefill_noise)
            if not self._fly(SCRIPTED, script, training.prefill):
                return
            self._env.reset()
            self._phase, self._done = "training", 0
        self._fly(self._config.learner.algorithm, self._explore, training.steps)

    def _fly(self, name: str, policy: Policy, steps: int) -> bool:
        """Fly a policy for at least `steps` environment steps and learn from it; returns whether it got that far."""
        _log.info("%s: %d of %d steps", self._phase, self._done, steps)
        self._logbook.begin(self._phase, name, steps, done=self._done)
        self._logbook.write_progress()
        while self._done < steps and not self._stop():
            self._reach(f"step-{self._logbook.flown}")
            begun = self._clocks.steady()
            self._step(policy, last=self._done + self._env.num_envs >= steps)
            self._done += self._env.num_envs
            if self._phase == "training":
                self._seconds += self._clocks.steady() - begun
            if self._logbook.flown >= self._next_checkpoint:
                self._keep()
        self._logbook.write_progress()
        return self._done >= steps

    def _step(self, policy: Policy, *, last: bool) -> None:
        """Fly a step, and begin the next one unless it is the `last`; a failed step is repeated as it was chosen.

        Chosen actions and losses are in `_under_way` before anything that may fail, and are not computed again.
        """
        observations = self._env.observations
        step = self._under_way = self._under_way or self._begun(observations, policy)
        if not self._env.is_under_way:
            self._env.send(step.actions)
        step = self._under_way = self._learned(step)
        if isinstance(self._env, VectorHover) and self._learner.off_policy and not last:
            for group in self._groups:
                step = self._flown_on(self._env, step, policy, group)
        result = self._env.receive()
        self._under_way = None if step.ahead is None else _PendingStep(step.ahead)
        transition = transition_of(observations, step.actions, result)
        self._learner.observe(transition)
        if self._records.replay is not None:
            self._records.replay.append(transition)
        self._logbook.enter(self._env.num_envs, result[-1], step.learned or {}, step.learning)

    def _begun(self, observations: Float32Array, policy: Policy) -> _PendingStep:
        """The step's actions. Where no workers would compute meanwhile, updates come before them and not beside them.

        So a rollout has no action of a policy before its updates.
        """
        if isinstance(self._env, VectorHover):
            return _PendingStep(self._chosen(observations, policy))
        begun = self._clocks.steady()
        learned = self._learner.learn()
        learning = self._clocks.steady() - begun
        return _PendingStep(self._chosen(observations, policy), learned=learned, learning=learning)

    def _learned(self, step: _PendingStep) -> _PendingStep:
        """The step after learning in it."""
        if step.learned is not None:
            return step
        begun = self._clocks.steady()
        learned = self._learner.learn()
        return replace(step, learned=learned, learning=self._clocks.steady() - begun)

    def _chosen(self, observations: Float32Array, policy: Policy) -> ActionArray:
        """The actions of all drones, chosen group by group, as they would have been ahead."""
        flights = self._env.flights
        return np.concatenate([policy(observations[group], flights[group]) for group in self._groups])

    def _flown_on(self, env: VectorHover, step: _PendingStep, policy: Policy, group: slice) -> _PendingStep:
        """The step once a group of drones has its estimates and has begun the next step."""
        observations, flights = env.receive_first(group.stop)
        ahead = np.empty((0, ACTION_SIZE), np.float32) if step.ahead is None else step.ahead
        if len(ahead) < group.stop:
            ahead = np.concatenate([ahead, policy(observations[group], flights[group])])
            step = self._under_way = replace(step, ahead=ahead)
        env.fly_on(ahead[group])
        return step

    def _explore(self, observations: Float32Array, flights: object) -> ActionArray:
        return self._learner.act(observations, explore=True)

    def _end(self) -> Summary:
        summary = self._summary()
        self._keep()
        self._save_weights()
        self._records.journal.summary(summary)
        self._logbook.begin("done", "", self._config.training.steps, done=self._trained)
        self._logbook.write_progress()
        return summary

    def _keep(self) -> None:
        """Write a checkpoint, unless this step has one; if the disk has no room, warn and try later."""
        flown = self._logbook.flown
        if flown == self._kept or not self._env.is_begun:
            return
        try:
            with self._observer.checkpoint():
                self._records.checkpoints.write(self._content(), self._sync)
            self._kept = flown
            self._plan_checkpoint()
            self._save_weights()
        except OSError as error:
            again = max(1, self._config.training.checkpoint_every // _TRIES)
            self._next_checkpoint = flown + again
            _log.warning("no checkpoint after %d steps, trying again after %d more: %s", flown, again, error)

    def _plan_checkpoint(self) -> None:
        every = self._config.training.checkpoint_every
        self._next_checkpoint = (self._logbook.flown // every + 1) * every

    def _sync(self) -> Grown:
        replay = self._records.replay
        return Grown(episodes=self._records.journal.sync(), replay=replay.sync() if replay else ())

    def _content(self) -> Content:
        return Content(
            step=self._logbook.flown,
            mean_return=self._logbook.flights.learners_return,
            weights=self._learner.weights(),
            about=self._about(),
            state=self._state(),
            measured=self._measured(),
        )

    def _state(self) -> dict[str, Any]:
        step = self._under_way
        under_way = step and {name: getattr(step, name) for name in step.__struct_fields__}
        return {
            "loop": {"phase": self._phase, "done": self._done, "under_way": under_way},
            "environment": self._env.state(),
            "learner": self._learner.state(),
            "logbook": self._logbook.state(),
        }

    def _measured(self) -> dict[str, Any]:
        calls = msgspec.to_builtins(self._all_calls())
        return {"seconds": self._seconds, "calls": calls, "stages": self._logbook.stage_times()}

    @property
    def _trained(self) -> int:
        return self._done if self._phase == "training" else 0

    def _all_calls(self) -> CallStatistics:
        """The counts of this process and of earlier ones."""
        return total(self._calls, self._counted())

    def _summary(self) -> Summary:
        calls = self._all_calls()
        return Summary(
            steps=self._trained,
            episodes=self._logbook.flights.count,
            updates=self._learner.updates,
            seconds=self._seconds,
            steps_per_second=self._trained / self._seconds if self._seconds > 0 else 0.0,
            stages=self._logbook.stages,
            late_replies=calls.late_replies,
            retries=calls.retries,
            complete=self._trained >= self._config.training.steps,
        )

    def _save_weights(self) -> None:
        save_weights(self._records.run / FILE_NAME, self._learner.weights(), self._about())

    def _about(self) -> dict[str, str]:
        return {
            "algorithm": self._config.learner.algorithm,
            "run_seed": str(self._config.seed),
            "steps": str(self._trained),
            "updates": str(self._learner.updates),
        }


def _groups(drones: int, count: int) -> list[slice]:
    """All drones in up to `count` groups of neighbours, none of them empty."""
    edges = [round(drones * number / count) for number in range(count + 1)]
    return [slice(first, end) for first, end in pairwise(edges) if first < end]


def transition_of(observations: Float32Array, actions: ActionArray, result: StepResult) -> Transition:
    """A step as learners take it; the next observation of a finished flight is its own last one."""
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
