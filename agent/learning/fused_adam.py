"""torch's fused Adam without the work that it does around its kernel at each step.

torch looks up each parameter's gradient and state, groups them by device and counts each parameter's steps by an
operator of its own. For layers this small that takes several times as long as the kernel.
"""

from typing import Any

import torch
from torch import Tensor
from torch.optim import Adam


class FusedAdam:
    """Takes an optimiser's steps, to the bit as it does itself; the state stays the optimiser's.

    Args:
        optimizer: of one group of parameters. Their gradients are changed in place from now on, never replaced; and
            after its state was replaced, by `load_state_dict` say, it takes another `FusedAdam`.

    Works without autograd: call it under `torch.no_grad` or `torch.inference_mode`.
    """

    def __init__(self, optimizer: Adam) -> None:
        (self._group,) = optimizer.param_groups
        # A state that was restored brings its own setting.
        self._group["fused"] = True
        self._optimizer = optimizer
        self._tensors: tuple[list[Tensor], ...] = ()
        self._settings: dict[str, Any] = {}

    @property
    def learning_rate(self) -> float:
        """The optimiser's; it may be set between steps."""
        return self._group["lr"]

    @learning_rate.setter
    def learning_rate(self, value: float) -> None:
        self._group["lr"] = value

    def step(self) -> None:
        """Change the parameters by their gradients."""
        if not self._tensors:
            # Where there is no state yet, the optimiser makes it; it outlasts an inference mode that this is called in.
            with torch.inference_mode(False):
                self._optimizer.step()
                self._take_up()
            return
        self._counts.add_(1)
        torch._fused_adam_(*self._tensors, lr=self.learning_rate, **self._settings)  # pyright: ignore[reportPrivateImportUsage]

    def _take_up(self) -> None:
        parameters: list[Tensor] = self._group["params"]
        gradients = [parameter.grad for parameter in parameters if parameter.grad is not None]
        states = [self._optimizer.state[parameter] for parameter in parameters]
        # Side by side, one operator counts all of them.
        self._counts = torch.stack([state["step"] for state in states])
        for state, count in zip(states, self._counts.unbind(), strict=True):
            state["step"] = count
        means, squares, counts = ([state[name] for state in states] for name in ("exp_avg", "exp_avg_sq", "step"))
        self._tensors = (parameters, gradients, means, squares, [], counts)
        beta1, beta2 = self._group["betas"]
        taken = {name: self._group[name] for name in ("weight_decay", "eps", "amsgrad", "maximize")}
        self._settings = {**taken, "beta1": beta1, "beta2": beta2}
