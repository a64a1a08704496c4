"""Every random generator of a learning process: seeded together, kept together, put back together."""

import random
from typing import Any

import numpy as np
import torch


def seed_all(seed: int) -> None:
    """Seed Python's, NumPy's and torch's generators."""
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 (libraries below us may draw from the legacy generator)
    torch.manual_seed(seed)


def random_state() -> dict[str, Any]:
    """Where all of them stand, as tensors and plain values."""
    return {"python": random.getstate(), "numpy": np.random.get_state(legacy=False), "torch": torch.get_rng_state()}  # noqa: NPY002


def restore_random_state(state: dict[str, Any]) -> None:
    """Put all of them back."""
    version, internal, gauss = state["python"]
    random.setstate((version, tuple(internal), gauss))
    np.random.set_state(state["numpy"])  # noqa: NPY002
    torch.set_rng_state(state["torch"])
