import numpy as np
import pytest
from msgspec.structs import replace

from agent.learning.algorithms import make_learner
from benchmarks.accelerator.sac_on_device import SacOnDevice
from benchmarks.stages_alone import measured_updates
from protocol.environment_config import EnvironmentConfig
from protocol.learner_config import LearnerConfig, SacConfig

ENVIRONMENT = EnvironmentConfig(num_envs=4)
CONFIG = replace(SacConfig(), batch_size=16, updates_per_step=0.25)


def weights_after(learner, updates=5):
    measured_updates(learner, CONFIG.batch_size, ENVIRONMENT.num_envs, updates)
    return learner.weights()


@pytest.mark.slow
def test_on_the_cpu_it_learns_what_the_agent_learns():
    # One after the other: each seeds the generators of the process, and draws from them.
    expected = weights_after(make_learner(LearnerConfig(sac=CONFIG), ENVIRONMENT, seed=3))
    found = weights_after(SacOnDevice(CONFIG, ENVIRONMENT, seed=3, device="cpu"))
    assert found.keys() == expected.keys()
    for name, weights in expected.items():
        np.testing.assert_allclose(found[name], weights, atol=1e-6, err_msg=name)
