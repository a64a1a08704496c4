"""Several drones at once, each with a person of its own, all their pose estimates under way at the same time.

A flight's move settles whether it is over, before any picture is taken. So the last estimates of finished flights and
the first ones of those that follow are requested together, and nothing depends on the order in which answers come back.
The first estimate of the next episode is requested while the others fly. Drones whose estimates are there may fly on
while those of the others come, so that the workers never wait for the policy.
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError, ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from agent.environment.arguments import require_autoreset, require_drones, require_no_rendering, require_split
from agent.environment.episode_seeds import GivenSeed, drawn_seed, episode_seed, require_seeds
from agent.environment.flight import Flight
from agent.environment.flight_state import flight_of, flight_state
from agent.environment.hover import info_of
from agent.environment.hover_task import HoverTask
from agent.environment.pending_flight import PendingFlight, request_estimate
from agent.environment.prefetch import EpisodePrefetch
from agent.environment.reset_options import reset_mask
from agent.environment.sensor import Sensor
from agent.environment.spaces import ACTION_SIZE, action_space, require_actions
from agent.environment.stages import StageTimes
from agent.environment.versions import hover_task
from protocol.arrays import BoolArray, Float32Array, Float64Array
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.scene import Split

StepResult: TypeAlias = tuple[Float32Array, Float64Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]


class _PendingStep(Struct, frozen=True, eq=False):
    """One drone's step: its flight, the flight that follows a finished one, and whether it flew at all."""

    pending: PendingFlight
    following: PendingFlight | None
    flew: bool


class _FinishedStep(Struct, frozen=True, eq=False):
    """One drone's step with its estimates, and the drone's observation: of the next flight after a finished one."""

    flight: Flight
    reward: float
    flew: bool
    times: StageTimes
    following: tuple[Flight, StageTimes] | None
    observation: Float32Array

    @property
    def current(self) -> tuple[Flight, StageTimes]:
        return self.following or (self.flight, self.times)


class VectorHover(VectorEnv[Float32Array, ArrayLike, NDArray[Any]]):
    """`num_envs` of `vantage/Hover-v0`, with `step` split into `send` and `receive` so that one can learn in between.

    Between these, `receive_first` and `fly_on` may begin the next step of all drones, some at a time, in their order:
    then `receive` ends the one step with the other under way. Each step is the same to the bit either way.

    A finished flight is followed by the next episode in the same step; its last observation and info are in
    `infos["final_obs"]` and `infos["final_info"]`. With autoreset disabled it stays where it is, with reward 0.
    """

    def __init__(
        self,
        sensor: Sensor,
        num_envs: int | None = None,
        config: EnvironmentConfig | None = None,
        split: Split = "train",
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        render_mode: str | None = None,
    ) -> None:
        """Check the arguments.

        Args:
            num_envs: drones; the configuration's, if none is given.
            autoreset_mode: whether a flight is followed by the next in the same step, or not at all; Gymnasium's, or
                its name there.
            render_mode: Gymnasium's; only None is offered.

        Raises:
            InvalidInput: another split, number of drones or autoreset mode, or a render mode.
        """
        require_no_rendering(render_mode)
        require_split(split)
        mode = require_autoreset(autoreset_mode)
        self.config = config or EnvironmentConfig()
        self.num_envs = self.config.num_envs if num_envs is None else require_drones(num_envs)
        self.metadata = {"render_modes": [], "autoreset_mode": mode}
        self._task: HoverTask = hover_task(self.config)
        self.single_observation_space = self._task.observation_space()
        self.single_action_space = action_space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.flights: tuple[Flight, ...] = ()
        self._sensor = sensor
        self._split: Split = split
        self._follows = mode is AutoresetMode.SAME_STEP
        self._run_seed = 0
        self._begun = 0
        self._prefetch = EpisodePrefetch()
        self._drop_steps()

    def reset(
        self, *, seed: GivenSeed = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32Array, dict[str, Any]]:
        """Begin an episode on every drone, or on some.

        Args:
            seed: the run's, from which follow those of its episodes 0, 1, 2, …; or the first episodes' own, one a
                drone; or none, to go on with the run's next episodes, as does a drone whose own is None.
            options: `{"reset_mask": (n,) bool}` begins an episode on the drones for which it is true: each the one
                that it would begin by this seed if all did. The others fly on undisturbed; infos describe those that
                began. Gymnasium's own vector environments do the same.

        Raises:
            InvalidInput: a seed is not a whole number of 0 or more, or one is missing; there is another option, or the
                mask is invalid. The episodes stay as they were.
            ResetNeeded: some drones are to begin anew before all have begun.
            AlreadyPendingCallError: some are to while a step of all is under way.
            CallFailed: an estimate did not come; the flights stay as they were.
        """
        seeds, begins = require_seeds(seed, self.num_envs), reset_mask(options, self.num_envs)
        self._require_others_at_rest(begins)
        self._drop_steps()
        self._prefetch.forget()
        if not isinstance(seeds, list) or (None in seeds and not self.flights):
            self._begin_run(seeds if isinstance(seeds, int) else None)
        numbered = self._first_seeds(seeds, begins)
        pending = {drone: self._requested(self._taken_off(one)) for drone, one in numbered.items()}
        finished = {drone: self._finish(_PendingStep(one, None, flew=False)) for drone, one in pending.items()}
        self.flights = tuple(
            finished[drone].flight if drone in finished else self.flights[drone] for drone in range(self.num_envs)
        )
        self._begun += self.num_envs if isinstance(seeds, int) else len(finished)
        return self.observations, self._infos(finished)

    @property
    def is_begun(self) -> bool:
        """Whether there are episodes."""
        return bool(self.flights)

    @property
    def observations(self) -> Float32Array:
        """(n, 111) the current observation of every drone."""
        return np.stack([self._task.observation(flight) for flight in self.flights])

    def state(self) -> dict[str, Any]:
        """Everything the episodes' future depends on, between two steps: arrays and plain values, nested."""
        return {
            "run_seed": self._run_seed,
            "begun": self._begun,
            "flights": [flight_state(flight) for flight in self.flights],
            "generators": {name: rng.bit_generator.state for name, rng in self._generators().items()},
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state` of an environment of the same configuration."""
        self._drop_steps()
        self._prefetch.forget()
        self._run_seed, self._begun = state["run_seed"], state["begun"]
        self.flights = tuple(flight_of(flight) for flight in state["flights"])
        for name, rng in self._generators().items():
            rng.bit_generator.state = state["generators"][name]

    @property
    def is_under_way(self) -> bool:
        """Whether a step was sent, or begun by `fly_on`, and not yet received."""
        return bool(self._under_way)

    def send(self, actions: ArrayLike) -> None:
        """Fly every drone for a step and request all its estimates.

        Raises:
            InvalidInput: an action is not three finite numbers; the episodes stay as they were.
        """
        if not self.flights:
            raise ResetNeeded("no episode was begun: call reset() first")
        if self.is_under_way:
            raise AlreadyPendingCallError("a step is under way already: call receive() first", "send")
        self._under_way = self._sent(self.flights, require_actions(actions, (self.num_envs, ACTION_SIZE)))

    def receive_first(self, drones: int) -> tuple[Float32Array, tuple[Flight, ...]]:
        """Wait for the estimates of the first `drones` drones; returns their observations (k, 111) and flights.

        The step is over once `receive` has the others as well; until then `flights` and `state` are those before it.

        Raises:
            CallFailed: an estimate did not come; see `receive`.
        """
        if not self._under_way:
            raise NoAsyncCallError("no step is under way: call send() first", "receive_first")
        self._prepare()
        try:
            while len(self._finished) < drones:
                self._finished.append(self._finish(self._under_way[len(self._finished)]))
        except BaseException:
            self._drop_steps()
            raise
        finished = self._finished[:drones]
        return np.stack([step.observation for step in finished]), tuple(step.current[0] for step in finished)

    def fly_on(self, actions: ArrayLike) -> None:
        """Begin the next step of the next drones whose estimates are there; actions (k, 3) in the drones' order.

        Raises:
            InvalidInput: an action is not three finite numbers, or there are more actions than drones that can fly on.
        """
        waiting = [step.current[0] for step in self._finished[len(self._ahead) :]]
        velocities = require_actions(actions, (np.size(actions) // ACTION_SIZE, ACTION_SIZE))
        if len(velocities) > len(waiting):
            raise InvalidInput(f"{len(velocities)} drones are to fly on where {len(waiting)} have their estimates")
        self._ahead += self._sent(waiting[: len(velocities)], velocities)

    def receive(self) -> StepResult:
        """Wait for the estimates of the step under way; observations (n, 111), rewards, terminated, truncated, infos.

        Raises:
            CallFailed: an estimate did not come; the episodes stay as before `send`, which may be called again.
        """
        if len(self._ahead) not in (0, self.num_envs):
            raise AlreadyPendingCallError("some drones have flown on and some have not: call fly_on()", "receive")
        observations, flights = self.receive_first(self.num_envs)
        finished, self._under_way = self._finished, self._ahead
        self._finished, self._ahead = [], []
        self.flights = flights
        self._begun += sum(step.following is not None for step in finished)
        return (
            observations,
            np.array([step.reward for step in finished]),
            np.array([step.flew and step.flight.terminated for step in finished]),
            np.array([step.flew and step.flight.outcome == "truncated" for step in finished]),
            self._infos(dict(enumerate(finished))),
        )

    def step(self, actions: ArrayLike) -> StepResult:
        """`send`, then `receive`."""
        self.send(actions)
        return self.receive()

    def _begin_run(self, seed: int | None) -> None:
        """Count episodes from 0 for a seed; without one, continue the run before, if there was one."""
        if seed is None and self.flights:
            return
        super().reset(seed=seed)
        self._run_seed, self._begun = drawn_seed(self.np_random) if seed is None else seed, 0
        # Gymnasium does not seed the spaces: samples from them would differ from process to process.
        self.action_space.seed(drawn_seed(self.np_random))
        self.single_action_space.seed(drawn_seed(self.np_random))

    def _generators(self) -> dict[str, np.random.Generator]:
        return {
            "environment": self.np_random,
            "actions": self.action_space.np_random,
            "single_actions": self.single_action_space.np_random,
        }

    def _first_seeds(self, given: int | list[int | None] | None, begins: BoolArray) -> dict[int, int]:
        """The seeds of the episodes that drones begin, by drone; where a run begins, a drone's number is its place."""
        drones = np.flatnonzero(begins).tolist()
        own = given if isinstance(given, list) else [None] * self.num_envs
        seeds: dict[int, int] = {}
        for nth, drone in enumerate(drones):
            named, number = own[drone], self._begun + (drone if isinstance(given, int) else nth)
            seeds[drone] = episode_seed(self._run_seed, number) if named is None else named
        return seeds

    def _require_others_at_rest(self, begins: BoolArray) -> None:
        """Refuse to begin some drones' episodes while those of the others are not between two steps."""
        if begins.all():
            return
        if not self.flights:
            raise ResetNeeded("no episode was begun: call reset() for all drones first")
        if self.is_under_way:
            raise AlreadyPendingCallError("a step is under way: call receive() first", "reset")

    def _sent(self, flights: Sequence[Flight], velocities: Float64Array) -> list[_PendingStep]:
        """Move drones and request the estimates of their steps."""
        moved = [
            flight if flight.over else self._task.move(flight, velocity)
            for flight, velocity in zip(flights, velocities, strict=True)
        ]
        following = self._following(moved)
        return [
            _PendingStep(
                pending=PendingFlight(self._task, flight) if before.over else self._requested(flight),
                following=after,
                flew=not before.over,
            )
            for before, flight, after in zip(flights, moved, following, strict=True)
        ]

    def _following(self, moved: list[Flight]) -> list[PendingFlight | None]:
        """The episodes that follow finished ones, in the drones' order."""
        number = self._next_number
        following: list[PendingFlight | None] = []
        for flight in moved:
            ends = flight.over and self._follows
            following.append(self._prefetch.take(number, self._begin_episode) if ends else None)
            number += ends
        return following

    @property
    def _next_number(self) -> int:
        """The number of the episode after those that begin in the steps under way."""
        return self._begun + sum(step.following is not None for step in (*self._under_way, *self._ahead))

    def _prepare(self) -> None:
        """Begin the next episode ahead of time."""
        if self._follows:
            self._prefetch.prepare(self._next_number, self._begin_episode)

    def _drop_steps(self) -> None:
        """Drop the step of all drones, the drones that have finished it, and the steps after it."""
        self._under_way: list[_PendingStep] = []
        self._finished: list[_FinishedStep] = []
        self._ahead: list[_PendingStep] = []

    def _begin_episode(self, number: int) -> PendingFlight:
        return self._requested(self._taken_off(episode_seed(self._run_seed, number)))

    def _taken_off(self, seed: int) -> Flight:
        return self._task.take_off(seed, self._sensor.sample(seed, self._split))

    def _finish(self, step: _PendingStep) -> _FinishedStep:
        flight, times = step.pending.finished()
        flight, reward = self._task.with_reward(flight) if step.flew else (flight, 0.0)
        following = step.following.finished() if step.following else None
        observation = self._task.observation(following[0] if following else flight)
        return _FinishedStep(flight, reward, step.flew, times, following, observation)

    def _infos(self, finished: Mapping[int, _FinishedStep]) -> dict[str, Any]:
        infos: dict[str, Any] = {}
        for index, step in finished.items():
            if step.following:
                final = {
                    "final_obs": self._task.observation(step.flight),
                    "final_info": info_of(self._task, step.flight, step.times),
                }
                infos = self._add_info(infos, final, index)
            infos = self._add_info(infos, info_of(self._task, *step.current), index)
        return infos

    def _requested(self, flight: Flight) -> PendingFlight:
        return request_estimate(flight, self._sensor, self._task)
