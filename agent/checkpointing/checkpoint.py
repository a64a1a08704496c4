"""A checkpoint: a directory with a manifest that has the length and the checksum of every file.

It holds everything that the training's future depends on. The replay memory is not in it but named by it: the journal's
segments, by length and checksum. Nothing in it is pickled.
"""

from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load_file, save

from agent.checkpointing.append_only_file import FileMark, mark_of, mark_of_bytes, require_intact
from agent.checkpointing.journal import EPISODES
from agent.checkpointing.replay_journal import Segment, require_segments
from agent.checkpointing.state_tree import join, split
from agent.checkpointing.weights import FILE_NAME as WEIGHTS
from agent.checkpointing.weights import encoded_weights, load_weights
from agent.errors import NewerFormat
from protocol.errors import ArtifactDamaged, ArtifactMissing
from protocol.text import UNDECODABLE

FORMAT = 1
MANIFEST, TENSORS, REST, MEASURED = "manifest.json", "state.safetensors", "state.msgpack", "measured.msgpack"
REPLAY = "replay"
"""The replay journal's place in a run directory."""


class Grown(Struct, frozen=True, kw_only=True):
    """The append-only files of a run, as they were at a moment; without a replay journal there are no segments."""

    episodes: FileMark
    replay: tuple[Segment, ...] = ()


class Content(Struct, frozen=True, eq=False, kw_only=True):
    """The content of a checkpoint, taken between two steps.

    Attributes:
        step: environment steps flown so far, prefill included.
        mean_return: over the learner's last flights; None before there are enough of them.
        weights: the parameters of all networks.
        about: a description of them, for readers of the file.
        state: everything else that the future depends on; with the weights, the same in every training of the same
            configuration, however often it was killed.
        measured: values that differ each time, such as seconds; used in records only.
    """

    step: int
    mean_return: float | None
    weights: dict[str, NDArray[Any]]
    about: dict[str, str]
    state: dict[str, Any]
    measured: dict[str, Any]


class Manifest(Struct, frozen=True, kw_only=True):
    """A checkpoint's description of itself.

    Attributes:
        config: the settings that the training's result depends on.
        files: of the checkpoint itself, by name.
        grown: files beside it that it needs.
    """

    format: int
    step: int
    mean_return: float | None
    config: dict[str, Any]
    files: dict[str, FileMark]
    grown: Grown


class Checkpoint(Struct, frozen=True):
    """A whole checkpoint in its place."""

    path: Path
    manifest: Manifest

    def weights(self) -> dict[str, NDArray[Any]]:
        """The parameters of all networks."""
        return load_weights(self.path / WEIGHTS)[0]

    def state(self) -> dict[str, Any]:
        """Everything else that the future depends on.

        Raises:
            ArtifactDamaged: it can't be read, though its checksum is right.
        """
        try:
            arrays = load_file(self.path / TENSORS)
        except SafetensorError as error:
            raise ArtifactDamaged(f"{self.path / TENSORS} can't be read: {error}") from error
        return join(arrays, (self.path / REST).read_bytes())

    def measured(self) -> dict[str, Any]:
        """The measured values."""
        return msgspec.msgpack.decode((self.path / MEASURED).read_bytes())

    def require_grown(self, run: Path) -> None:
        """Make sure that the run directory still has the append-only files that the checkpoint names.

        Raises:
            JournalDamaged: a file is missing, shorter, or begins otherwise.
        """
        require_intact(run / EPISODES, self.manifest.grown.episodes)
        require_segments(run / REPLAY, self.manifest.grown.replay)


def write_files(directory: Path, content: Content) -> dict[str, FileMark]:
    """Write weights and state to an empty directory; returns their marks."""
    arrays, rest = split(content.state)
    files = {WEIGHTS: encoded_weights(content.weights, content.about), TENSORS: save(arrays), REST: rest}
    files[MEASURED] = msgspec.msgpack.encode(content.measured)
    for name, data in files.items():
        (directory / name).write_bytes(data)
    return {name: mark_of_bytes(data) for name, data in files.items()}


def write_manifest(directory: Path, manifest: Manifest) -> None:
    """Write the manifest; it comes last, so that a checkpoint with a manifest is whole."""
    (directory / MANIFEST).write_bytes(msgspec.json.format(msgspec.json.encode(manifest)) + b"\n")


def read_manifest(directory: Path) -> Manifest:
    """A checkpoint's manifest.

    Raises:
        ArtifactDamaged, ArtifactMissing: it can't be read.
        NewerFormat: a later version of Vantage wrote it.
    """
    path = directory / MANIFEST
    if not path.is_file():
        raise ArtifactMissing(f"{path} is missing")
    text = path.read_bytes()
    try:
        written = msgspec.json.decode(text, type=_Format).format
        if written <= FORMAT:
            return msgspec.json.decode(text, type=Manifest)
    except UNDECODABLE as error:
        raise ArtifactDamaged(f"{path} can't be read: {error}") from error
    raise NewerFormat(f"{path} has the format {written}, this version of Vantage reads up to {FORMAT}; use a later one")


def read_checkpoint(directory: Path) -> Checkpoint:
    """The checkpoint of a directory, with all of its files verified.

    Raises:
        ArtifactDamaged, ArtifactMissing: a file differs from its mark, or the manifest can't be read.
        NewerFormat: a later version of Vantage wrote it.
    """
    manifest = read_manifest(directory)
    for name, mark in manifest.files.items():
        path = directory / name
        if not path.is_file():
            raise ArtifactMissing(f"{path} is missing")
        if mark_of(path) != mark:
            raise ArtifactDamaged(f"{path} is not what was written")
    return Checkpoint(directory, manifest)


class _Format(Struct, frozen=True):
    """The part of a manifest that every version has."""

    format: int
