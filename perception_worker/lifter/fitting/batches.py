"""Batches of a lifter's training: augmented frames, half of them mirrored."""

from collections.abc import Iterator, Sequence

import numpy as np
import torch
from msgspec import Struct
from numpy.typing import NDArray
from torch import Tensor

from perception_worker.lifter.fitting.frames import Frames, confused, made_harder, rescaled
from perception_worker.lifter.tokens import INPUTS, Tokens, mirrored, tokens_of
from protocol.arrays import Float32Array
from protocol.skeleton import MIRRORED


class Batch(Struct, frozen=True, eq=False):
    """Some frames: tokens (n, 18, TOKEN_SIZE), rays (n, 18, 2), depth (n,) and true joints (n, 18, 3)."""

    tokens: Tensor
    rays: Tensor
    depth: Tensor
    truth: Tensor


def batches(frames: Frames, size: int, without: Sequence[str], random: np.random.Generator) -> Iterator[Batch]:
    """All frames once, in a random order.

    Args:
        without: names of `INPUTS` that are 0 in every token.
    """
    order = random.permutation(len(frames))
    for first in range(0, len(order), size):
        yield _batch(frames.of(order[first : first + size]), without, random)


def blinded(tokens: Tokens, without: Sequence[str]) -> Tokens:
    """Tokens in which some of `INPUTS` are 0."""
    for name in without:
        tokens.values[:, :, INPUTS[name]] = 0.0
    return tokens


def _batch(frames: Frames, without: Sequence[str], random: np.random.Generator) -> Batch:
    frames = rescaled(frames, random)
    tokens = blinded(tokens_of(made_harder(confused(frames.seen, random), random)), without)
    turned = random.random(len(frames)) < 0.5
    return Batch(*map(torch.from_numpy, _turned(tokens, frames, turned)))


def _turned(tokens: Tokens, frames: Frames, turned: NDArray[np.bool_]) -> tuple[Float32Array, ...]:
    """Tokens, rays, depths and truth, some of them as a mirror shows them."""
    values, rays, truth = tokens.values, tokens.rays.astype(np.float32), frames.joints.astype(np.float32)
    values[turned] = mirrored(values[turned])
    rays[turned] = rays[turned][:, MIRRORED] * np.array([-1.0, 1.0], np.float32)
    truth[turned] = truth[turned][:, MIRRORED] * np.array([-1.0, 1.0, 1.0], np.float32)
    return values, rays, tokens.depth.astype(np.float32), truth
