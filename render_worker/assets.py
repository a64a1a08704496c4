"""The baked file: bodies, their skeleton and garments, and the photographs that surroundings are made of.

`python -m render_worker.bake` makes it once. It holds plain arrays only, all that a renderer needs.
All lengths are metres; all positions are in the body frame (x to the front, y to the left, z up).
"""

import json
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol.arrays import Float32Array, Float64Array, UInt8Array
from protocol.artifact import BODIES_VERSION, bodies_path, require_artifact, whole_file
from protocol.errors import ArtifactDamaged
from protocol.skeleton import Joint
from render_worker.arrays import IndexArray
from render_worker.people.skinning import vertex_normals
from render_worker.surfaces import Surface
from render_worker.textures import Spot, spots_of

FORMAT = "vantage-bodies"
VERSION = BODIES_VERSION
MADE_BY = "orchestrator bodies bake"

PARTS = ("skin", "tights", "skirt", "long_hair", "left_eye", "right_eye", "lashes")
MASKS = ("lips", "ears", "nails", "brows", "scalp", "stubble")
PHOTOGRAPHS = ("brick", "grass", "gravel", "coffee", "chelsea")

_HAIR_REACH = 0.1
"""Body heights below the nose down to which hair that does not fall can grow."""


@dataclass(frozen=True)
class Part:
    """A textured surface of every body.

    Attributes:
        source: (c,) body vertex of each corner; a corner is a vertex with one place in the texture.
        uv: (c, 2) texture coordinates, v upwards.
        triangles: (t, 3) corners, counter-clockwise seen from outside.
    """

    source: IndexArray
    uv: Float32Array
    triangles: IndexArray


@dataclass(frozen=True)
class Rig:
    """The skeleton that all identities share.

    Attributes:
        labels: (b,) names of the bones.
        parents: (b,) each bone's parent, always earlier in the list; -1 for the root.
        weights: (n, b) share of each bone in each vertex; rows sum to 1.
        regressor: (18, n) COCO-18 joints as weighted means of the vertices.
    """

    labels: tuple[str, ...]
    parents: tuple[int, ...]
    weights: Float32Array
    regressor: Float32Array

    @cached_property
    def exact_regressor(self) -> Float64Array:
        """(18, n) the regressor in the precision of joints."""
        return self.regressor.astype(float)


@dataclass(frozen=True)
class Assets:
    """Everything that was baked.

    Attributes:
        vertices: (60, n, 3) every identity at rest.
        bone_heads: (60, b, 3) where each identity's bones start, at rest.
        canonical: (n, 3) the mean body at rest, by which garments are cut, height running from 0 to 1.
        along_arm: (n,) 0 on the trunk, 0 to 1 on the upper arm, 1 to 2 on the forearm, above on the hand.
        masks: (size, size) each, 0 to 255 over the skin's texture, the first row at v = 0.
        photographs: (height, width, 3) each.
        provenance: its sources, and its largest error of skinning.
    """

    vertices: Float32Array
    bone_heads: Float32Array
    canonical: Float32Array
    along_arm: Float32Array
    rig: Rig
    parts: Mapping[str, Part]
    masks: Mapping[str, UInt8Array]
    photographs: Mapping[str, UInt8Array]
    provenance: Mapping[str, Any]

    @cached_property
    def face(self) -> Float64Array:
        """(18, 3) joints of the mean body, of which hair takes those of the face."""
        return self.rig.exact_regressor @ self.canonical.astype(float)

    @cached_property
    def surfaces(self) -> Mapping[str, Surface]:
        """The surface of each part that all bodies have in common."""
        return {
            name: Surface.of(part.source, part.uv, part.triangles, self.canonical, self.along_arm)
            for name, part in self.parts.items()
        }

    @cached_property
    def scalp(self) -> Surface:
        """The skin that hair can grow on, and that around it."""
        return self.surfaces["skin"].above(self.face[Joint.NOSE, 2] - _HAIR_REACH)

    @cached_property
    def spots(self) -> Mapping[str, Spot]:
        """The spots in which masks are not empty."""
        return spots_of(self.masks)

    @cached_property
    def rest_normals(self) -> Callable[[int], Float32Array]:
        """(n, 3) unit normals of an identity's body at rest; kept for all identities, some 10 MB."""
        triangles = np.concatenate([part.source[part.triangles] for part in self.parts.values()])
        return lru_cache(len(self.vertices))(lambda identity: vertex_normals(self.vertices[identity], triangles))


def assets_path(configured: str | None = None) -> Path:
    """The path of the baked file: the configured one, or its place in the user's cache."""
    return Path(configured) if configured else bodies_path()


def save_assets(path: Path, assets: Assets) -> None:
    """Write the baked file; it appears whole or not at all."""
    arrays: dict[str, NDArray[Any]] = {
        "format": np.array(FORMAT),
        "version": np.array(VERSION),
        "provenance": np.array(json.dumps(dict(assets.provenance))),
        "vertices": assets.vertices,
        "bone_heads": assets.bone_heads,
        "canonical": assets.canonical,
        "along_arm": assets.along_arm,
        "bone_labels": np.array(assets.rig.labels),
        "bone_parents": np.array(assets.rig.parents, np.int32),
        **_sparse("weights", assets.rig.weights),
        **_sparse("regressor", assets.rig.regressor),
        **{f"mask_{name}": mask for name, mask in assets.masks.items()},
        **{f"photograph_{name}": image for name, image in assets.photographs.items()},
    }
    for name, part in assets.parts.items():
        arrays |= {f"{name}_source": part.source, f"{name}_uv": part.uv, f"{name}_triangles": part.triangles}
    with whole_file(path) as aside:
        np.savez_compressed(aside, allow_pickle=False, **arrays)


def load_assets(path: Path) -> Assets:
    """Read the baked file.

    Raises:
        ArtifactMissing: it does not exist yet; the message names the command that makes it.
        ArtifactDamaged: it is cut off, of another version, or another kind of file.
    """
    require_artifact(path, made_by=MADE_BY)
    try:
        # numpy would leave a damaged file open.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            return _decode(stored)
    except (zipfile.BadZipFile, OSError, EOFError, KeyError, ValueError, IndexError) as error:
        raise ArtifactDamaged(
            f"{path} is no whole file of bodies ({error}); '{MADE_BY} --force' makes it anew"
        ) from error


def _decode(stored: Mapping[str, NDArray[Any]]) -> Assets:
    if str(stored["format"]) != FORMAT or int(stored["version"]) != VERSION:
        raise ValueError(f"it is {stored['format']} {stored['version']}, not {FORMAT} {VERSION}")
    return Assets(
        vertices=stored["vertices"],
        bone_heads=stored["bone_heads"],
        canonical=stored["canonical"],
        along_arm=stored["along_arm"],
        rig=Rig(
            labels=tuple(str(label) for label in stored["bone_labels"]),
            parents=tuple(int(parent) for parent in stored["bone_parents"]),
            weights=_dense("weights", stored),
            regressor=_dense("regressor", stored),
        ),
        parts={
            name: Part(stored[f"{name}_source"], stored[f"{name}_uv"], stored[f"{name}_triangles"]) for name in PARTS
        },
        masks={name: stored[f"mask_{name}"] for name in MASKS},
        photographs={name: stored[f"photograph_{name}"] for name in PHOTOGRAPHS},
        provenance=json.loads(str(stored["provenance"])),
    )


def _sparse(name: str, matrix: Float32Array) -> dict[str, NDArray[Any]]:
    rows, columns = np.nonzero(matrix)
    return {
        f"{name}_shape": np.array(matrix.shape, np.int32),
        f"{name}_rows": rows.astype(np.int32),
        f"{name}_columns": columns.astype(np.int32),
        f"{name}_values": matrix[rows, columns],
    }


def _dense(name: str, stored: Mapping[str, NDArray[Any]]) -> Float32Array:
    matrix = np.zeros(tuple(stored[f"{name}_shape"]), np.float32)
    matrix[stored[f"{name}_rows"], stored[f"{name}_columns"]] = stored[f"{name}_values"]
    return matrix
