"""A clothed person as one mesh: everything that a renderer uploads for a scene's body.

Garments are cut from helper surfaces per pixel: each corner carries signed distances to the garment's edges, and a
pixel where one of them is negative has no cloth. Skin that cloth hides is left out, so it can't show through.
"""

from typing import NamedTuple

import numpy as np

from protocol.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from protocol.scene import Figure
from protocol.skeleton import Joint
from render_worker.arrays import IndexArray, RealArray
from render_worker.assets import Assets
from render_worker.body import Body, pose_body
from render_worker.hairline import fall_depth, hair_depth
from render_worker.outfit import Garment, Hair, Outfit, sample_outfit
from render_worker.textures import eye_texture, fabric_texture, hair_texture, plain_texture, skin_texture

_HIDDEN_MARGIN = 0.012
"""Skin is left out where cloth reaches this much further, in body heights."""

_FABRIC_REPEATS = 3.0
"""How often a fabric's texture repeats over the body's height."""

_NO_EDGE = 1.0

_OPEN_PARTS = ("skirt", "long_hair")


class Corners(NamedTuple):
    """A surface ready to draw; arrays have one row a corner.

    Attributes:
        position, normal: (c, 3) in the body frame.
        uv: (c, 3) texture coordinates and the number of the texture.
        cut: (c, 3) signed distances to edges; nothing is drawn where one is negative.
        triangles: (t, 3).
        closed: whether its inside can't be seen.
    """

    position: Float32Array
    normal: Float32Array
    uv: Float32Array
    cut: Float32Array
    triangles: IndexArray
    closed: bool


class Person(NamedTuple):
    """What a renderer uploads of somebody, and where their joints are.

    Attributes:
        corners: (c, 12) float32: position, normal, texture coordinates and number, distances to edges.
        closed: (t, 3) triangles that lie inside all edges, of surfaces whose inside can't be seen.
        open: (u, 3) triangles that an edge crosses, or that are seen from both sides.
        textures: (k, size, size, 3) sRGB.
        joints: (18, 3) COCO-18 in the body frame, metres.
    """

    corners: Float32Array
    closed: IndexArray
    open: IndexArray
    textures: UInt8Array
    joints: Float64Array


def dress(assets: Assets, figure: Figure) -> Person:
    """Pose and clothe somebody in a scene, in the body frame."""
    body = pose_body(assets, figure.identity, figure.pose)
    outfit = sample_outfit(figure.appearance, feminine=is_feminine(assets, figure.identity))
    surfaces = [_skin(assets, body, outfit), *_eyes(assets, body), _lashes(assets, body)]
    textures = [skin_texture(outfit, assets.spots), eye_texture(outfit.eyes), plain_texture((34, 26, 24))]
    for garment in outfit.garments:
        surfaces.append(_garment(assets, body, garment, len(textures)))
        textures.append(fabric_texture(garment.fabric))
    if outfit.hair is not None:
        surfaces += _hair(assets, body, outfit.hair, len(textures))
        textures.append(hair_texture(outfit.hair))
    return _join(surfaces, np.stack(textures), body.joints)


def is_feminine(assets: Assets, identity: int) -> bool:
    """Whether an identity's body is rather a woman's."""
    return float(assets.provenance["phenotypes"][identity]["gender"]) > 0.5


def _surface(assets: Assets, body: Body, part: str, texture: int, offset: RealArray | float = 0.0) -> Corners:
    surface = assets.parts[part]
    normal = body.normals[surface.source]
    lift = np.broadcast_to(np.asarray(offset, np.float32), (len(surface.source),))[:, None]
    number = np.full((len(surface.source), 1), texture, np.float32)
    return Corners(
        position=(body.vertices[surface.source] + lift * normal).astype(np.float32),
        normal=normal,
        uv=np.hstack([surface.uv, number]),
        cut=np.full((len(surface.source), 3), _NO_EDGE, np.float32),
        triangles=surface.triangles,
        closed=part not in _OPEN_PARTS,
    )


def _skin(assets: Assets, body: Body, outfit: Outfit) -> Corners:
    corners = _surface(assets, body, "skin", 0)
    source = assets.parts["skin"].source
    points, along_arm = assets.canonical[source], assets.along_arm[source]
    hidden = np.zeros(len(source), bool)
    for garment in outfit.garments:
        if garment.part == "tights":
            hidden |= edges(garment, points, along_arm).min(axis=1) > _HIDDEN_MARGIN
    return corners._replace(triangles=corners.triangles[~hidden[corners.triangles].all(axis=1)])


def _garment(assets: Assets, body: Body, garment: Garment, texture: int) -> Corners:
    corners = _surface(assets, body, garment.part, texture, garment.offset)
    source = assets.parts[garment.part].source
    points = assets.canonical[source]
    uv = corners.uv.copy()
    uv[:, :2] = points[:, 1:] * _FABRIC_REPEATS
    return corners._replace(uv=uv, cut=edges(garment, points, assets.along_arm[source]))


def edges(garment: Garment, points: Float32Array, along_arm: Float32Array) -> Float32Array:
    """(c, 3) signed distances of points on the mean body to a garment's hem, neckline and sleeves, positive inside."""
    height = points[:, 2]
    # A neckline is lower in front, and there it is lowest in the middle.
    chest = np.maximum(points[:, 0], 0) * np.clip(1 - np.abs(points[:, 1]) / 0.07, 0, 1)
    sleeve = 0.19 * (garment.sleeve - along_arm) if garment.sleeve > 0 else 0.5 - along_arm
    inside = [height - garment.lowest, garment.highest - height - garment.neck * chest, sleeve]
    return np.stack(inside, axis=1).astype(np.float32)


def _eyes(assets: Assets, body: Body) -> list[Corners]:
    """Eyeballs, textured by projection along the view."""
    made: list[Corners] = []
    for part in ("left_eye", "right_eye"):
        corners = _surface(assets, body, part, 1)
        points = assets.canonical[assets.parts[part].source]
        centre = (points.min(axis=0) + points.max(axis=0)) / 2
        radius = float(np.ptp(points[:, 2])) / 2
        uv = corners.uv.copy()
        uv[:, :2] = 0.5 + (points[:, 1:] - centre[1:]) / (2 * radius)
        made.append(corners._replace(uv=uv))
    return made


def _lashes(assets: Assets, body: Body) -> Corners:
    return _surface(assets, body, "lashes", 2)


def _hair(assets: Assets, body: Body, hair: Hair, texture: int) -> list[Corners]:
    """The scalp, raised, and what falls behind the ears."""
    face = assets.rig.regressor.astype(float) @ assets.canonical.astype(float)
    scalp = assets.canonical[assets.parts["skin"].source]
    on_head = scalp[:, 2] > face[Joint.NOSE, 2] - 0.1
    depth = np.where(on_head, hair_depth(scalp, face, hair.length), -1.0).astype(np.float32)
    # Thin at the hairline, so that it does not stand off like a cap.
    lift = hair.thickness * np.sqrt(np.clip(depth / 0.02, 0.02, 1))
    made = [_combed(_surface(assets, body, "skin", texture, lift), scalp, face, depth)]
    if hair.falls > 0:
        falling = assets.canonical[assets.parts["long_hair"].source]
        corners = _surface(assets, body, "long_hair", texture)
        made.append(_combed(corners, falling, face, fall_depth(falling, face, hair.falls)))
    return made


def _combed(corners: Corners, points: Float32Array, face: Float64Array, depth: Float32Array) -> Corners:
    """Strands run down from the crown, and end where `depth` does."""
    around = np.arctan2(points[:, 1], points[:, 0] - face[Joint.LEFT_EAR, 0])
    uv = np.stack([around * 2, points[:, 2] * 6, corners.uv[:, 2]], axis=1)
    beyond = np.full_like(depth, _NO_EDGE)
    return corners._replace(uv=uv, cut=np.stack([depth, beyond, beyond], axis=1))


def _any_of_three(flags: BoolArray) -> BoolArray:
    """(n,) whether one of each row (n, 3) is set."""
    return flags[:, 0] | flags[:, 1] | flags[:, 2]


def _join(surfaces: list[Corners], textures: UInt8Array, joints: Float64Array) -> Person:
    rows: list[Float32Array] = []
    closed: list[IndexArray] = []
    seen_through: list[IndexArray] = []
    start = 0
    for surface in surfaces:
        # Corner by corner: numpy is slow to go along axes of three.
        first, second, third = (surface.cut < 0)[surface.triangles.T]
        kept = ~_any_of_three(first & second & third)
        hides_inside = ~_any_of_three(first | second | third) & surface.closed
        closed.append(surface.triangles[hides_inside] + start)
        seen_through.append(surface.triangles[kept & ~hides_inside] + start)
        rows.append(np.hstack([surface.position, surface.normal, surface.uv, surface.cut]))
        start += len(surface.position)
    return Person(
        np.concatenate(rows).astype(np.float32), np.concatenate(closed), np.concatenate(seen_through), textures, joints
    )
