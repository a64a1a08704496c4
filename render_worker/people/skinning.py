"""From turned bones to a posed surface: forward kinematics and linear blend skinning.

A bone's rotation is given in the body frame and counts from the body at rest, so no bone has axes of its own.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from protocol.arrays import Float32Array, Float64Array
from render_worker.arrays import IndexArray


def bone_transforms(
    heads: Float64Array,
    parents: Sequence[int],
    rotations: Mapping[int, Float64Array],
    twists: Mapping[int, int],
) -> Float64Array:
    """The rigid motion of every bone from the body at rest to the posed one.

    Args:
        heads: (b, 3) where each bone starts, at rest.
        parents: each bone's parent, earlier in the list; -1 for the root.
        rotations: (3, 3) of the bones that turn otherwise than their parents.
        twists: bones that only continue another one, and turn about its head instead of their own: twisted about the
            whole limb's axis, they leave the limb's end where it is.

    Returns:
        (b, 4, 4).
    """
    transforms = np.tile(np.eye(4), (len(parents), 1, 1))
    for bone, parent in enumerate(parents):
        pivot = twists.get(bone, bone)
        carrier = transforms[parents[pivot]] if parents[pivot] >= 0 else np.eye(4)
        inherited = transforms[parent, :3, :3] if parent >= 0 else np.eye(3)
        rotation = rotations.get(bone, inherited)
        transforms[bone, :3, :3] = rotation
        transforms[bone, :3, 3] = apply(carrier, heads[pivot]) - rotation @ heads[pivot]
    return transforms


def apply(transform: Float64Array, point: Float64Array) -> Float64Array:
    """A point (3,) moved by a rigid motion (4, 4)."""
    return transform[:3, :3] @ point + transform[:3, 3]


def blend(weights: Float32Array, transforms: Float64Array) -> Float32Array:
    """Each vertex's own motion: the mean of its bones' motions by its weights (n, b), as (n, 3, 4)."""
    motions = weights @ transforms[:, :3].reshape(len(transforms), 12).astype(np.float32)
    return motions.reshape(-1, 3, 4)


def move_points(motions: Float32Array, points: Float32Array) -> Float32Array:
    """Points (n, 3), each moved by its own motion (n, 3, 4)."""
    return np.einsum("nij,nj->ni", motions[:, :, :3], points) + motions[:, :, 3]


def move_normals(motions: Float32Array, normals: Float32Array) -> Float32Array:
    """Unit normals (n, 3), each turned by its own motion (n, 3, 4)."""
    return unit(np.einsum("nij,nj->ni", motions[:, :, :3], normals))


def vertex_normals(vertices: Float32Array, triangles: IndexArray) -> Float32Array:
    """(n, 3) unit normals, each the mean over the triangles around a vertex, weighted by area; 0 where none is."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    corners, sums = triangles.T.ravel(), np.tile(faces, (3, 1))
    count = len(vertices)
    total = np.stack([np.bincount(corners, sums[:, axis], count) for axis in range(3)], axis=1)
    return unit(total.astype(np.float32))


def unit(vectors: Float32Array) -> Float32Array:
    """Vectors (n, 3) scaled to length 1; a zero vector stays zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
