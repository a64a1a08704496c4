"""Multilayer perceptrons: ReLU between layers, inputs standardised by the samples that they learn from."""

from collections.abc import Callable
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import torch
from msgspec import Struct
from torch import Tensor, nn

from protocol.arrays import Float32Array, Float64Array

Loss: TypeAlias = Callable[[Tensor, Tensor], Tensor]
"""Of outputs (n, k), and of targets (n, …)."""

_LEAST_SPREAD = 1e-6
_AT_ONCE = 65536


class Recipe(Struct, frozen=True, kw_only=True):
    """The settings of a training.

    Attributes:
        hidden: neurons of each layer between the inputs and the outputs.
        epochs: how often each sample is learned from.
        falling: whether the learning rate falls to 0 over the training, by a half cosine.
    """

    hidden: tuple[int, ...]
    epochs: int
    batch: int = 64
    learning_rate: float = 1e-3
    weight_decay: float = 0.0
    dropout: float = 0.0
    falling: bool = False


class Perceptron:
    """A trained perceptron."""

    def __init__(self, network: nn.Sequential, mean: Float32Array, spread: Float32Array) -> None:
        self._network = network.eval()
        self._mean = mean
        self._spread = spread

    def predict(self, inputs: Float32Array) -> Float64Array:
        """(n, k) the outputs for inputs (n, d)."""
        with torch.no_grad():
            parts = [
                self._network(torch.from_numpy((part - self._mean) / self._spread)).numpy()
                for part in np.array_split(inputs, -(-len(inputs) // _AT_ONCE))
            ]
        return np.concatenate(parts).astype(np.float64)


def trained(
    inputs: Float32Array, targets: Float32Array | Tensor, outputs: int, recipe: Recipe, loss: Loss, seed: int
) -> Perceptron:
    """Train a perceptron by Adam.

    Args:
        inputs: (n, d).
        targets: (n, …) whatever the loss takes.
        outputs: k, the number of outputs.
        seed: of the weights and of the order of the samples.
    """
    mean, spread = inputs.mean(axis=0), np.maximum(inputs.std(axis=0), _LEAST_SPREAD)
    samples = torch.from_numpy((inputs - mean) / spread)
    wanted = torch.as_tensor(targets)
    generator = torch.Generator().manual_seed(seed)
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        network = _network((inputs.shape[1], *recipe.hidden, outputs), recipe.dropout)
        _train(network, samples, wanted, recipe, loss, generator)
    return Perceptron(network, mean, spread)


def _train(
    network: nn.Sequential, samples: Tensor, wanted: Tensor, recipe: Recipe, loss: Loss, generator: torch.Generator
) -> None:
    optimizer = torch.optim.AdamW(network.parameters(), recipe.learning_rate, weight_decay=recipe.weight_decay)
    steps = recipe.epochs * -(-len(samples) // recipe.batch)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps) if recipe.falling else None
    for _ in range(recipe.epochs):
        for batch in torch.randperm(len(samples), generator=generator).split(recipe.batch):
            optimizer.zero_grad(set_to_none=True)
            loss(network(samples[batch]), wanted[batch]).backward()
            optimizer.step()
            if schedule is not None:
                schedule.step()


def _network(sizes: tuple[int, ...], dropout: float) -> nn.Sequential:
    layers: list[nn.Module] = []
    for inward, outward in pairwise(sizes[:-1]):
        layers += [nn.Linear(inward, outward), nn.ReLU(), nn.Dropout(dropout)]
    return nn.Sequential(*layers, nn.Linear(sizes[-2], sizes[-1]))
