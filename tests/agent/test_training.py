import itertools
import threading
from pathlib import Path

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from agent.checkpointing.weights import load_weights
from agent.environment.episode_seeds import episode_seed
from agent.environment.vector_hover import VectorHover
from agent.learning.algorithms import make_learner
from agent.learning.learner import Learner
from agent.training import transition_of
from protocol.config import RunConfig, TrainingConfig
from protocol.environment_config import EnvironmentConfig
from protocol.records import Episode, Progress, Summary
from tests.agent.analytic_sensor import TIMING, AnalyticSensor
from tests.agent.trainings import CONFIG, trained


class Recorder:
    """A learner that notes what is done with it, in order."""

    updates = 0
    memory_steps = 0

    def __init__(self, learner: Learner, *, off_policy: bool) -> None:
        self.learner = learner
        self.off_policy = off_policy
        self.done: list[str] = []

    def act(self, observations, *, explore):
        self.done.append("act")
        return self.learner.act(observations, explore=explore)

    def observe(self, transition) -> None:
        self.done.append("observe")

    def learn(self) -> dict[str, float]:
        self.done.append("learn")
        return {}

    def state(self) -> dict:
        return {}

    def weights(self) -> dict:
        return self.learner.weights()


def lines(path: Path, kind):
    return [msgspec.json.decode(line, type=kind) for line in path.read_bytes().splitlines()]


@pytest.mark.slow
def test_a_training_leaves_weights_curves_episodes_progress_and_a_summary(tmp_path) -> None:
    summary = trained(tmp_path)
    assert summary == msgspec.json.decode((tmp_path / "summary.json").read_bytes(), type=Summary)
    assert (summary.steps, summary.late_replies, summary.retries) == (30, 2, 1)
    assert summary.updates == (20 + 30 - 2 - 8) / 2, (
        "half of the transitions' but the last step's, once there was a batch"
    )
    assert summary.steps_per_second == pytest.approx(30 / summary.seconds)
    assert set(summary.stages) == {"render", "infer", "transport", "learn"}
    weights, about = load_weights(tmp_path / "weights.safetensors")
    assert any(name.startswith("policy.") for name in weights)
    assert (about["algorithm"], about["steps"], about["run_seed"]) == ("sac", "30", "3")
    episodes = lines(tmp_path / "episodes.jsonl", Episode)
    assert len(episodes) == summary.episodes == 10
    assert [episode.policy for episode in episodes] == ["scripted"] * 4 + ["sac"] * 6
    progress = lines(tmp_path / "progress.jsonl", Progress)
    assert list(dict.fromkeys(line.phase for line in progress)) == ["prefill", "training", "done"]
    assert list((tmp_path / "tensorboard").iterdir())


@pytest.mark.slow
def test_episodes_follow_from_the_runs_seed(tmp_path) -> None:
    trained(tmp_path)
    seeds = [episode.seed for episode in lines(tmp_path / "episodes.jsonl", Episode)]
    # Two flights are cut off where the learner takes over from the script: numbers 4 and 5.
    assert seeds == [episode_seed(3, number) for number in (0, 1, 2, 3, 6, 7, 8, 9, 10, 11)]


@pytest.mark.parametrize("algorithm", ["sac", "ppo"])
@pytest.mark.slow
def test_the_same_seed_trains_the_same_weights_however_the_workers_answer(tmp_path, algorithm) -> None:
    config = replace(CONFIG, learner=replace(CONFIG.learner, algorithm=algorithm))
    delays = itertools.cycle((0.01, 0.0, 0.004))

    def late(pending, observation) -> None:
        threading.Timer(next(delays), pending.succeed, (observation, TIMING)).start()

    trained(tmp_path / "at once", config)
    trained(tmp_path / "late", config, sensor=AnalyticSensor(late))
    trained(tmp_path / "other", replace(config, seed=4))
    names = ("at once", "late", "other")
    one, again, other = [load_weights(tmp_path / name / "weights.safetensors")[0] for name in names]
    assert all(np.array_equal(one[name], again[name]) for name in one)
    assert not all(np.array_equal(one[name], other[name]) for name in one)


def noted(tmp_path: Path, config: RunConfig, *, off_policy: bool) -> list[str]:
    """What a training of four drones does, in order."""
    learner = Recorder(make_learner(config.learner, config.environment, seed=0), off_policy=off_policy)

    class Env(VectorHover):
        def send(self, actions) -> None:
            learner.done.append("send")
            super().send(actions)

        def receive_first(self, drones):
            if drones > len(self._finished):
                learner.done.append(f"receive {drones}")
            return super().receive_first(drones)

        def fly_on(self, actions) -> None:
            learner.done.append(f"fly on {len(actions)}")
            super().fly_on(actions)

    trained(tmp_path, config, learner=learner, env=Env(AnalyticSensor(), config=config.environment))
    return learner.done


FOUR_DRONES = replace(
    CONFIG, environment=replace(CONFIG.environment, num_envs=4), training=TrainingConfig(steps=12, prefill=0)
)


def test_half_of_the_drones_fly_on_while_the_pictures_of_the_others_come(tmp_path) -> None:
    by_halves = ["learn", "receive 2", "act", "fly on 2", "receive 4", "act", "fly on 2", "observe"]
    done = noted(tmp_path, FOUR_DRONES, off_policy=True)
    assert done == ["act", "act", "send", *by_halves, *by_halves, "learn", "receive 4", "observe"]


def test_on_policy_a_step_is_observed_before_the_next_is_chosen(tmp_path) -> None:
    done = noted(tmp_path, FOUR_DRONES, off_policy=False)
    assert done == ["act", "send", "learn", "receive 4", "observe"] * 3


def test_ppo_trains_by_one_line_of_the_configuration(tmp_path) -> None:
    summary = trained(tmp_path, replace(CONFIG, learner=replace(CONFIG.learner, algorithm="ppo")))
    assert (summary.steps, summary.updates) == (30, 2 * 2)
    assert {episode.policy for episode in lines(tmp_path / "episodes.jsonl", Episode)} == {"ppo"}, "no scripted flights"


def test_a_request_to_stop_leaves_weights_and_a_summary(tmp_path) -> None:
    asked = itertools.chain([False] * 14, itertools.repeat(True))
    summary = trained(tmp_path, stop=asked.__next__)
    assert summary.steps == 8, "four steps of two drones, after ten of the script"
    assert load_weights(tmp_path / "weights.safetensors")[1]["steps"] == "8"
    last = lines(tmp_path / "progress.jsonl", Progress)[-1]
    assert (last.phase, last.step, last.steps) == ("done", 8, 30)


def test_a_training_can_be_held_before_each_of_its_steps(tmp_path) -> None:
    places: list[str] = []
    trained(tmp_path, failpoint=places.append)
    assert [place for place in places if place.startswith("step-")] == [f"step-{flown}" for flown in range(0, 50, 2)]


def test_a_request_to_stop_while_prefilling_does_not_begin_to_train(tmp_path) -> None:
    asked = itertools.chain([False] * 3, itertools.repeat(True))
    assert trained(tmp_path, stop=asked.__next__).steps == 0


def test_weights_are_there_before_the_end(tmp_path) -> None:
    class Crash(Exception):
        pass

    answers = itertools.count()

    def fail_late(pending, observation) -> None:
        if next(answers) > 80:
            pending.fail(Crash("workers are gone"), TIMING)
        else:
            pending.succeed(observation, TIMING)

    with pytest.raises(Crash):
        trained(
            tmp_path, replace(CONFIG, training=replace(CONFIG.training, steps=1000)), sensor=AnalyticSensor(fail_late)
        )
    assert int(load_weights(tmp_path / "weights.safetensors")[1]["steps"]) >= 10
    assert not (tmp_path / "summary.json").exists()


def test_what_follows_a_finished_flight_is_its_own_last_observation() -> None:
    env = VectorHover(AnalyticSensor(), config=EnvironmentConfig(num_envs=2, episode_steps=1))
    observations, _ = env.reset(seed=0)
    actions = np.zeros((2, 3), np.float32)
    result = env.step(actions)
    transition = transition_of(observations, actions, result)
    assert transition.truncated.all()
    assert np.array_equal(transition.next_observations, np.stack(result[-1]["final_obs"].tolist()))
    assert np.array_equal(transition.next_observations[:, 108:], observations[:, 108:])
    assert not np.array_equal(result[0], transition.next_observations)
