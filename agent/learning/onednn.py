"""Matrix products by oneDNN, where it is faster than torch's own choice.

torch multiplies matrices by MKL, which leaves AVX-512 alone on processors that are not Intel's. oneDNN does not; it is
reached by the operator that torch's compiler uses for linear layers.
"""

import torch
from torch import Tensor

WIDE = 32
"""Rows, or numbers of a row, from which on oneDNN is faster, although a call of it costs more."""

_AVAILABLE = torch.backends.mkldnn.is_available() and hasattr(torch.ops.mkldnn, "_linear_pointwise")
HAS_AVX512 = torch.backends.cpu.get_cpu_capability() == "AVX512"
"""Without it, oneDNN is no faster than MKL where it has to turn the batch round first, as for weights' gradients."""


def takes(weight: Tensor) -> bool:
    """Whether oneDNN is there and computes in a weight's precision."""
    return _AVAILABLE and weight.dtype == torch.float32


def packed(weight: Tensor, rows: int) -> Tensor:
    """A weight in oneDNN's own layout for so many rows; where `linear` gets it many times, that is faster."""
    return torch.ops.mkldnn._reorder_linear_weight.default(weight, rows)


def linear(inputs: Tensor, weight: Tensor, bias: Tensor | None = None, then: str = "none") -> Tensor:
    """`F.linear` and what follows it; the overload is named, since finding it takes part of a call's time."""
    return torch.ops.mkldnn._linear_pointwise.default(inputs, weight, bias, then, [], "")
