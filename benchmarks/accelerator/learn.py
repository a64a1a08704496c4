"""Gradient updates of SAC, the room's own or the same on a GPU; a process of `benchmarks.accelerator`."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from agent.learning.algorithms import make_learner
from benchmarks.accelerator.measured import Measured, hand_over, options_of, save_arrays
from benchmarks.stages_alone import Updating, measured_updates
from protocol.config import RunConfig
from protocol.errors import Unavailable
from protocol.learner_config import LearnerConfig, SacConfig


class Learner(Updating, Protocol):
    """The measured parts of a learner."""

    def weights(self) -> dict[str, NDArray[Any]]:
        """The parameters of all its networks, by name."""
        ...


def learner_on(device: str, config: SacConfig) -> Learner:
    """The agent's own learner on the CPU; on another device the same agent of skrl's.

    Raises:
        Unavailable: torch has no such device.
    """
    environment = RunConfig().environment
    if device == "cpu":
        return make_learner(LearnerConfig(algorithm="sac", sac=config), environment, seed=0)
    import torch

    if not torch.cuda.is_available():
        raise Unavailable("PyTorch sees no CUDA device")
    from benchmarks.accelerator.sac_on_device import SacOnDevice

    return SacOnDevice(config, environment, seed=0, device=device)


def _name_of(device: str) -> str:
    if device == "cpu":
        return "1 thread"
    import torch

    return torch.cuda.get_device_name(device)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and hand over."""
    options = options_of(arguments, __doc__)
    config = RunConfig()
    envs = config.environment.num_envs
    learner = learner_on(options.device, replace(config.learner.sac, updates_per_step=1 / envs))
    seconds = measured_updates(learner, config.learner.sac.batch_size, envs, options.count)
    weights = learner.weights()
    flat = np.concatenate([weights[name].ravel() for name in sorted(weights)])
    hand_over(
        Measured(
            device=f"PyTorch, {_name_of(options.device)}",
            on_gpu=options.device != "cpu",
            # The first ones compile and choose; a training makes thousands.
            seconds={"learn, one update": seconds[len(seconds) // 10 :]},
            digests=save_arrays(options.arrays, {"weights": flat}),
        )
    )


if __name__ == "__main__":
    main()
