"""A learner's parameters as a file: whole or not there, and nothing in it that runs."""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from protocol.artifact import require_artifact, whole_file
from protocol.errors import ArtifactDamaged

FILE_NAME = "weights.safetensors"


def save_weights(path: Path, weights: dict[str, NDArray[Any]], about: dict[str, str]) -> None:
    """Write the parameters and, as text, what they are `about`; the file before stands until this one is whole."""
    with whole_file(path) as aside:
        save_file(weights, aside, metadata=about)


def load_weights(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """The parameters in a file, and what they are about.

    Raises:
        ArtifactMissing, ArtifactDamaged: there is no such file, or it is cut off.
    """
    require_artifact(path, made_by="orchestrator train")
    try:
        with safe_open(path, framework="numpy") as file:
            return {name: file.get_tensor(name) for name in file.keys()}, dict(file.metadata() or {})  # noqa: SIM118
    except SafetensorError as error:
        raise ArtifactDamaged(f"{path} holds no weights ({error}); train again") from error
