"""Training of a lifter's network: so many times over all frames, each time harder and half of them in a mirror."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import torch
from msgspec import Struct
from numpy.typing import NDArray
from torch import Tensor
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from perception_worker.lifter.fitting.frames import Frames, made_harder, rescaled
from perception_worker.lifter.fitting.model import LifterModel, lifted, loss
from perception_worker.lifter.network import Shape
from perception_worker.lifter.tokens import INPUTS, MIRRORED, Tokens, mirrored, tokens_of
from protocol.arrays import Float32Array


class Training(Struct, frozen=True, kw_only=True):
    """How a network learns.

    Attributes:
        averaging: how much of the weights' average stays with each step.
        without: names of `INPUTS` that are 0 in every token; none, but for who wants to know what they are worth.
    """

    epochs: int = 60
    batch: int = 256
    learning_rate: float = 2e-3
    weight_decay: float = 1e-2
    averaging: float = 0.998
    seed: int = 0
    without: tuple[str, ...] = ()


class _Batch(Struct, frozen=True, eq=False):
    tokens: Tensor
    rays: Tensor
    depth: Tensor
    truth: Tensor


def train(
    frames: Frames, shape: Shape, training: Training, *, told: Callable[[int, float], None]
) -> dict[str, Float32Array]:
    """The weights of a network that has learned.

    Args:
        told: given the number of each epoch and its mean loss.
    """
    torch.manual_seed(training.seed)
    random = np.random.default_rng(training.seed)
    model = LifterModel(shape)
    average = AveragedModel(model, multi_avg_fn=get_ema_multi_avg_fn(training.averaging))
    steps = training.epochs * -(-len(frames) // training.batch)
    optimizer = torch.optim.AdamW(model.parameters(), training.learning_rate, weight_decay=training.weight_decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, training.learning_rate, total_steps=steps)
    for epoch in range(training.epochs):
        losses: list[float] = []
        for batch in _batches(frames, training, random):
            outputs = model(batch.tokens)
            points = lifted(outputs, batch.rays, batch.depth)
            value = loss(outputs, points, batch.truth, batch.rays)
            optimizer.zero_grad(set_to_none=True)
            value.backward()
            torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
            optimizer.step()
            schedule.step()
            average.update_parameters(model)
            losses.append(value.item())
        told(epoch, float(np.mean(losses)))
    model.load_state_dict(average.module.state_dict())
    return {name: weight.detach().numpy().copy() for name, weight in model.weights().items()}


def blinded(tokens: Tokens, without: Sequence[str]) -> Tokens:
    """Tokens in which some of `INPUTS` are 0."""
    for name in without:
        tokens.values[:, :, INPUTS[name]] = 0.0
    return tokens


def _batches(frames: Frames, training: Training, random: np.random.Generator) -> Iterator[_Batch]:
    order = random.permutation(len(frames))
    for first in range(0, len(order), training.batch):
        yield _batch(frames.of(order[first : first + training.batch]), training.without, random)


def _batch(frames: Frames, without: Sequence[str], random: np.random.Generator) -> _Batch:
    frames = rescaled(frames, random)
    tokens = blinded(tokens_of(made_harder(frames.seen, random)), without)
    turned = random.random(len(frames)) < 0.5
    return _Batch(*map(torch.from_numpy, _turned(tokens, frames, turned)))


def _turned(tokens: Tokens, frames: Frames, turned: NDArray[np.bool_]) -> tuple[Float32Array, ...]:
    """Tokens, rays, depths and truth, some of them as a mirror shows them."""
    values, rays, truth = tokens.values, tokens.rays.astype(np.float32), frames.joints.astype(np.float32)
    values[turned] = mirrored(values[turned])
    rays[turned] = rays[turned][:, MIRRORED] * np.array([-1.0, 1.0], np.float32)
    truth[turned] = truth[turned][:, MIRRORED] * np.array([-1.0, 1.0, 1.0], np.float32)
    return values, rays, tokens.depth.astype(np.float32), truth
