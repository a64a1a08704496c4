"""A learner's parameters as a file: written whole, nothing in it executes, and equal parameters give equal bytes."""

from pathlib import Path
from typing import Any

import msgspec
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from protocol.artifact import require_artifact, whole_file
from protocol.errors import ArtifactDamaged
from protocol.text import UNDECODABLE

FILE_NAME = "weights.safetensors"
_ABOUT = "about"


def save_weights(path: Path, weights: dict[str, NDArray[Any]], about: dict[str, str]) -> None:
    """Write the parameters and, as text, what they are `about`; the file is replaced whole."""
    with whole_file(path) as aside:
        aside.write_bytes(encoded_weights(weights, about))


def encoded_weights(weights: dict[str, NDArray[Any]], about: dict[str, str]) -> bytes:
    """The file's content."""
    # In one entry, since safetensors orders entries differently in each process.
    return save(weights, metadata={_ABOUT: msgspec.json.encode(about, order="sorted").decode()})


def load_weights(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """The parameters in a file, and what they are about.

    Raises:
        ArtifactMissing, ArtifactDamaged: there is no such file, or it is cut off.
    """
    require_artifact(path, made_by="orchestrator train")
    try:
        with safe_open(path, framework="numpy") as file:
            about = (file.metadata() or {}).get(_ABOUT, "{}")
            weights = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
            return weights, msgspec.json.decode(about, type=dict[str, str])
    except (SafetensorError, *UNDECODABLE) as error:
        raise ArtifactDamaged(f"{path} holds no weights ({error}); train again") from error
