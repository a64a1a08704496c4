"""The grid with other libraries' checks and learners, as they are.

They are imported where they are used: they load slowly, and every process of pytest imports every test.
"""

import gymnasium
import pytest

import agent  # noqa: F401 (registers the environment)
from tests.agent.environment.grid.tables import table

pytestmark = pytest.mark.slow


def test_stable_baselines_checker_has_nothing_to_say() -> None:
    from stable_baselines3.common.env_checker import check_env

    check_env(gymnasium.make("vantage/Grid-v0", table=table()).unwrapped)


def test_recurrent_ppo_of_sb3_contrib_trains_on_it_unchanged() -> None:
    from sb3_contrib import RecurrentPPO

    env = gymnasium.make("vantage/Grid-v0", table=table())
    model = RecurrentPPO("MlpLstmPolicy", env, n_steps=64, batch_size=32, n_epochs=2, seed=0, device="cpu")
    before = [parameter.detach().clone() for parameter in model.policy.parameters()]
    model.learn(256)
    assert model.num_timesteps == 256
    assert any((old != new).any() for old, new in zip(before, model.policy.parameters(), strict=True))
