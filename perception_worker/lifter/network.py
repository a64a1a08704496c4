"""A small transformer over a body's joints, in numpy, so that a lifter needs no torch.

Each joint's token becomes `width` numbers, layers of attention and of a hidden layer add to them, and five numbers come
out: the joint's position, and how far off it may be. Norms have no factors, since the layers after them have.
"""

from collections.abc import Mapping
from typing import NamedTuple, TypeAlias

import numpy as np
from msgspec import Struct

from perception_worker.lifter.tokens import TOKEN_SIZE
from protocol.arrays import Float32Array
from protocol.errors import ArtifactDamaged
from protocol.skeleton import JOINT_COUNT

OUTPUT_SIZE = 5
"""x, y and z of a joint, and the logarithms of how far off it may be across the view and along it, metres."""

NORM_EPSILON = 1e-5

_ROWS_AT_ONCE = JOINT_COUNT // 2

Weights: TypeAlias = Mapping[str, Float32Array]


class Shape(Struct, frozen=True, forbid_unknown_fields=True):
    """How large a network is."""

    width: int = 96
    heads: int = 4
    layers: int = 3
    hidden: int = 192

    def parameters(self) -> dict[str, tuple[int, ...]]:
        """The name and shape of each array of weights; matrices take rows of inputs from the left."""
        width, hidden = self.width, self.hidden
        shapes: dict[str, tuple[int, ...]] = {"input": (TOKEN_SIZE, width), "joints": (JOINT_COUNT, width)}
        for layer in range(self.layers):
            shapes |= {
                f"{layer}.attention.input": (width, 3 * width),
                f"{layer}.attention.input_bias": (3 * width,),
                f"{layer}.attention.output": (width, width),
                f"{layer}.attention.output_bias": (width,),
                f"{layer}.hidden": (width, hidden),
                f"{layer}.hidden_bias": (hidden,),
                f"{layer}.output": (hidden, width),
                f"{layer}.output_bias": (width,),
            }
        return shapes | {"output": (width, OUTPUT_SIZE), "output_bias": (OUTPUT_SIZE,)}


class _Layer(NamedTuple):
    attend: Float32Array
    attend_bias: Float32Array
    merge: Float32Array
    merge_bias: Float32Array
    hide: Float32Array
    hide_bias: Float32Array
    show: Float32Array
    show_bias: Float32Array


class LifterNetwork:
    """Computes on one thread's caches; may be used by several threads at once.

    Raises:
        ArtifactDamaged: an array is missing, has another shape, or has a number that is not finite.
    """

    def __init__(self, shape: Shape, weights: Weights) -> None:
        for name, wanted in shape.parameters().items():
            if name not in weights or weights[name].shape != wanted or not np.isfinite(weights[name]).all():
                raise ArtifactDamaged(f"the lifter's weights {name} are not {wanted} finite numbers")
        self._heads = shape.heads
        self._input, self._joints = weights["input"], weights["joints"]
        names = [name.removeprefix("0.") for name in shape.parameters() if name.startswith("0.")]
        layers = [_Layer(*(weights[f"{layer}.{name}"] for name in names)) for layer in range(shape.layers)]
        self._layers = [_scaled(layer, shape) for layer in layers]
        self._output, self._output_bias = weights["output"], weights["output_bias"]

    def __call__(self, tokens: Float32Array) -> Float32Array:
        """(n, 18, OUTPUT_SIZE) for tokens (n, 18, TOKEN_SIZE)."""
        frames = len(tokens)
        told = _product(tokens.reshape(-1, tokens.shape[2]), self._input)
        state = told.reshape(frames, JOINT_COUNT, -1) + self._joints
        state = state.reshape(frames * JOINT_COUNT, -1)
        for layer in self._layers:
            state += self._attended(_normed(state), layer, frames)
            hidden = _product(_normed(state), layer.hide) + layer.hide_bias
            state += _product(np.maximum(hidden, 0.0, out=hidden), layer.show) + layer.show_bias
        return (_product(_normed(state), self._output) + self._output_bias).reshape(frames, JOINT_COUNT, OUTPUT_SIZE)

    def _attended(self, state: Float32Array, layer: _Layer, frames: int) -> Float32Array:
        asked = (_product(state, layer.attend) + layer.attend_bias).reshape(frames, JOINT_COUNT, 3, self._heads, -1)
        query, key, value = asked.transpose(2, 0, 3, 1, 4)
        scores = query @ key.swapaxes(2, 3)
        scores -= scores.max(axis=3, keepdims=True)
        np.exp(scores, out=scores)
        scores /= scores.sum(axis=3, keepdims=True)
        told = (scores @ value).transpose(0, 2, 1, 3).reshape(len(state), -1)
        return _product(told, layer.merge) + layer.merge_bias


def _scaled(layer: _Layer, shape: Shape) -> _Layer:
    """The layer with its queries divided by the root of a head's width, as attention has it."""
    factors = np.ones(3 * shape.width, np.float32)
    factors[: shape.width] = (shape.width / shape.heads) ** -0.5
    return layer._replace(attend=layer.attend * factors, attend_bias=layer.attend_bias * factors)


def _product(rows: Float32Array, matrix: Float32Array) -> Float32Array:
    """`rows @ matrix` in pieces too small for a BLAS to share among threads, which would change the order of sums."""
    pieces = rows.reshape(-1, _ROWS_AT_ONCE, rows.shape[1])
    return (pieces @ matrix).reshape(len(rows), matrix.shape[1])


def _normed(state: Float32Array) -> Float32Array:
    """(n, width) each row with mean 0 and variance 1."""
    centred = state - state.mean(axis=1, keepdims=True)
    variance = np.einsum("ij,ij->i", centred, centred)[:, None] / np.float32(state.shape[1])
    centred /= np.sqrt(variance + np.float32(NORM_EPSILON))
    return centred
