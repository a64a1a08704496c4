import pytest
from msgspec.structs import replace

from benchmarks.recurrent_ppo import OURS, THEIRS, Ours, Speed, Theirs, Turn, markdown, timed
from protocol.grid_config import GridConfig
from protocol.learner_config import RecurrentPpoConfig
from tests.agent.environment.grid.tables import table

CONFIG = replace(RecurrentPpoConfig(), lstm_hidden_size=8, hidden_size=8, n_steps=4, minibatches=2)


def test_a_speed_is_that_of_the_median_turn() -> None:
    turns = [Turn(own=1.0, clock=2.0), Turn(own=2.0, clock=8.0), Turn(own=9.0, clock=4.0)]
    assert Speed.median(turns, steps=100) == Speed(own=50.0, clock=25.0)


def test_the_ratio_is_that_of_the_processes_own_time() -> None:
    rows = markdown({OURS: Speed(2500.0, 1000.0), THEIRS: Speed(250.0, 500.0)}).splitlines()[2:]
    assert rows == ["| Vantage | 2500 | 1000 | 10.0 | 1.0 |", "| sb3-contrib | 250 | 500 | 100.0 | 10.0 |"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [Ours, Theirs])
def test_a_turn_is_a_rollout_and_its_updates(kind) -> None:
    learner = kind(CONFIG, GridConfig(num_envs=4), table())
    first, second = timed(learner.take_turn), timed(learner.take_turn)
    assert min(first.own, first.clock, second.own, second.clock) > 0.0
    model = learner._learner if kind is Ours else learner._model
    updates = model.updates if kind is Ours else model._n_updates * CONFIG.minibatches
    assert updates == 2 * CONFIG.n_epochs * CONFIG.minibatches
