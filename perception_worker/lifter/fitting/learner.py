"""A network in training, with the whole state of the training, so that it resumes as if it had not stopped."""

from collections.abc import Iterable
from typing import Any, cast

import numpy as np
import torch
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from perception_worker.lifter.fitting.batches import Batch
from perception_worker.lifter.fitting.model import LifterModel, lifted, loss
from perception_worker.lifter.network import Shape
from protocol.arrays import Float32Array

_LARGEST_GRADIENT = 1.0


class Learner:
    """A network with its optimizer, and the average of its weights, which is the result.

    Args:
        steps: of the whole training, by which the learning rate rises and falls.
        averaging: how much of the average stays with each step.
    """

    def __init__(
        self, shape: Shape, *, steps: int, learning_rate: float, weight_decay: float, averaging: float, seed: int
    ) -> None:
        torch.manual_seed(seed)
        self.random = np.random.default_rng(seed)
        self._model = LifterModel(shape)
        self._average = AveragedModel(self._model, multi_avg_fn=get_ema_multi_avg_fn(averaging))
        self._optimizer = torch.optim.AdamW(self._model.parameters(), learning_rate, weight_decay=weight_decay)
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(self._optimizer, learning_rate, total_steps=steps)

    def learn(self, batches: Iterable[Batch]) -> float:
        """A step for each batch; the mean of their losses."""
        return float(np.mean([self._step(batch) for batch in batches]))

    def weights(self) -> dict[str, Float32Array]:
        """The averaged weights, by the names of the parameters."""
        model = cast(LifterModel, self._average.module)
        return {name: weight.detach().numpy().copy() for name, weight in model.weights().items()}

    def state(self) -> dict[str, Any]:
        """Everything that changes with a step."""
        parts = {name: part.state_dict() for name, part in self._parts().items()}
        return parts | {"torch": torch.get_rng_state(), "numpy": self.random.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Resume from a state of a learner with the same arguments."""
        for name, part in self._parts().items():
            part.load_state_dict(state[name])
        torch.set_rng_state(state["torch"])
        self.random.bit_generator.state = state["numpy"]

    def _step(self, batch: Batch) -> float:
        outputs = self._model(batch.tokens)
        value = loss(outputs, lifted(outputs, batch.rays, batch.depth), batch.truth, batch.rays)
        self._optimizer.zero_grad(set_to_none=True)
        value.backward()
        torch.nn.utils.clip_grad_norm_(self._model.parameters(), _LARGEST_GRADIENT)
        self._optimizer.step()
        self._schedule.step()
        self._average.update_parameters(self._model)
        return value.item()

    def _parts(self) -> dict[str, Any]:
        return {
            "model": self._model,
            "average": self._average,
            "optimizer": self._optimizer,
            "schedule": self._schedule,
        }
