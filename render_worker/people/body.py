"""A posed person in the body frame: the surface, its normals and the true joints."""

from typing import NamedTuple

import numpy as np

from protocol.arrays import Float32Array, Float64Array
from protocol.scene import BodyPose
from render_worker.assets import Assets
from render_worker.people.posing import pose_bones
from render_worker.people.skinning import blend, bone_transforms, move_normals, move_points


class Body(NamedTuple):
    """An identity in a pose, standing on the ground of the body frame.

    Attributes:
        vertices: (n, 3) metres.
        normals: (n, 3) unit vectors.
        joints: (18, 3) COCO-18, metres.
    """

    vertices: Float32Array
    normals: Float32Array
    joints: Float64Array


def pose_body(assets: Assets, identity: int, pose: BodyPose) -> Body:
    """Pose an identity; the lowest point of its skin is on the ground, the middle of its hips above the origin."""
    rest, heads = assets.vertices[identity], assets.bone_heads[identity].astype(float)
    rig = assets.rig
    bones = pose_bones(pose, heads, rig.labels)
    transforms = bone_transforms(heads, rig.parents, bones.rotations, bones.twists)
    motions = blend(rig.weights, transforms)
    vertices = move_points(motions, rest)
    heights = vertices[:, 2].take(assets.surfaces["skin"].source)
    vertices -= _origin(heights, heads, rig.labels)
    normals = move_normals(motions, assets.rest_normals(identity))
    return Body(vertices, normals, rig.exact_regressor @ vertices.astype(float))


def _origin(heights: Float32Array, heads: Float64Array, labels: tuple[str, ...]) -> Float32Array:
    hips = (heads[labels.index("upperleg01.L")] + heads[labels.index("upperleg01.R")]) / 2
    return np.array([hips[0], hips[1], heights.min()], np.float32)
