"""Training of a lifter's network in epochs. A killed training resumes after the last whole epoch."""

import logging
from collections.abc import Callable
from pathlib import Path
from pickle import UnpicklingError
from typing import Any

import torch
from msgspec import Struct

from perception_worker.lifter.fitting.batches import batches
from perception_worker.lifter.fitting.frames import Frames
from perception_worker.lifter.fitting.learner import Learner
from perception_worker.lifter.network import Shape
from protocol.arrays import Float32Array
from protocol.artifact import whole_file

_logger = logging.getLogger(__name__)


class Training(Struct, frozen=True, kw_only=True):
    """The settings of a training.

    Attributes:
        averaging: how much of the weights' average stays with each step.
        without: names of `INPUTS` that are 0 in every token, for ablations.
    """

    epochs: int = 40
    batch: int = 256
    learning_rate: float = 2e-3
    weight_decay: float = 1e-2
    averaging: float = 0.998
    seed: int = 0
    without: tuple[str, ...] = ()


class Kept(Struct, frozen=True):
    """The file of a training under way.

    Attributes:
        fit: identifies the fit; the training of another fit is not resumed.
    """

    path: Path
    fit: str

    def save(self, epochs: int, learner: Learner) -> None:
        """Write the training after `epochs` epochs."""
        with whole_file(self.path) as aside:
            torch.save({"fit": self.fit, "epochs": epochs, "learner": learner.state()}, aside)

    def load(self) -> dict[str, Any] | None:
        """The kept training of this fit, if there is one."""
        try:
            held = torch.load(self.path, weights_only=True)
        except FileNotFoundError:
            return None
        except (OSError, RuntimeError, EOFError, UnpicklingError) as error:
            _logger.warning("%s can't be read, so training begins anew: %s", self.path, error)
            return None
        return held if isinstance(held, dict) and held.get("fit") == self.fit else None


def train(
    frames: Frames, shape: Shape, training: Training, *, told: Callable[[int, float], None], kept: Kept | None = None
) -> dict[str, Float32Array]:
    """Train a network; returns its weights.

    Args:
        told: called with the number of each epoch and its mean loss.
        kept: the file that holds the training after each epoch, and from which it resumes.
    """
    learner = _learner(len(frames), shape, training)
    begun = _resumed(learner, kept)
    for epoch in range(begun, training.epochs):
        mean = learner.learn(batches(frames, training.batch, training.without, learner.random))
        if kept is not None:
            kept.save(epoch + 1, learner)
        told(epoch, mean)
    return learner.weights()


def _resumed(learner: Learner, kept: Kept | None) -> int:
    """Restore a kept training; returns its epochs."""
    held = None if kept is None else kept.load()
    if held is None:
        return 0
    learner.restore(held["learner"])
    _logger.info("going on after %d epochs", held["epochs"])
    return held["epochs"]


def _learner(frames: int, shape: Shape, training: Training) -> Learner:
    return Learner(
        shape,
        steps=training.epochs * -(-frames // training.batch),
        learning_rate=training.learning_rate,
        weight_decay=training.weight_decay,
        averaging=training.averaging,
        seed=training.seed,
    )
