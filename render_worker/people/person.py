"""A clothed person as one mesh: everything that a renderer uploads for a scene's body.

Garments are cut from helper surfaces per pixel: each corner carries signed distances to the garment's edges, and a
pixel where one of them is negative has no cloth. Skin that cloth hides is left out, so it can't show through.
"""

from typing import NamedTuple

import numpy as np

from protocol.arrays import Float32Array, Float64Array
from protocol.scene import Figure
from protocol.skeleton import Joint
from render_worker.arrays import IndexArray, RealArray
from render_worker.assets import Assets
from render_worker.people.body import Body, pose_body
from render_worker.people.hairline import fall_depth, hair_depth
from render_worker.people.outfit import Garment, Hair, Outfit, sample_outfit
from render_worker.surfaces import Surface
from render_worker.textures import Levels, eye_texture, fabric_texture, hair_texture, plain_texture, skin_texture

_HIDDEN_MARGIN = 0.012
"""Skin is left out where cloth reaches this much further, in body heights."""

_FABRIC_REPEATS = 3.0
"""How often a fabric's texture repeats over the body's height."""

_NO_EDGE = 1.0


class Corners(NamedTuple):
    """A surface ready to draw.

    Attributes:
        position, normal: (c, 3) in the body frame.
        uv: (c, 2) texture coordinates.
        texture: its number.
        triangles: (t, 3).
        closed: whether its inside can't be seen.
        cut: (3, c) signed distances to edges; nothing is drawn where one is negative. None where there is no edge.
    """

    position: Float32Array
    normal: Float32Array
    uv: RealArray
    texture: int
    triangles: IndexArray
    closed: bool = True
    cut: RealArray | None = None


class Person(NamedTuple):
    """A person as a renderer uploads them, and the positions of their joints.

    Attributes:
        corners: (c, 12) float32: position, normal, texture coordinates and number, distances to edges.
        closed: (t, 3) triangles that lie inside all edges, of surfaces whose inside can't be seen.
        open: (u, 3) triangles that an edge crosses, or that are seen from both sides.
        textures: of each its levels (size, size, 4), sRGB and opaque.
        joints: (18, 3) COCO-18 in the body frame, metres.
    """

    corners: Float32Array
    closed: IndexArray
    open: IndexArray
    textures: tuple[Levels, ...]
    joints: Float64Array


def dress(assets: Assets, figure: Figure) -> Person:
    """Pose and clothe a person of a scene, in the body frame."""
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
    return _join(surfaces, tuple(textures), body.joints)


def is_feminine(assets: Assets, identity: int) -> bool:
    """Whether an identity's body is rather a woman's."""
    return float(assets.provenance["phenotypes"][identity]["gender"]) > 0.5


def _surface(surface: Surface, body: Body, texture: int, offset: RealArray | float = 0.0) -> Corners:
    position = body.vertices.take(surface.source, axis=0)
    normal = body.normals.take(surface.source, axis=0)
    position += np.asarray(offset, np.float32)[..., None] * normal
    return Corners(
        position=position,
        normal=normal,
        uv=surface.uv,
        texture=texture,
        triangles=surface.triangles,
    )


def _skin(assets: Assets, body: Body, outfit: Outfit) -> Corners:
    skin = assets.surfaces["skin"]
    hidden = np.zeros(len(skin.source), bool)
    for garment in outfit.garments:
        if garment.part == "tights":
            hidden |= edges(garment, skin.points, skin.along_arm).min(axis=0) > _HIDDEN_MARGIN
    first, second, third = (hidden.take(corners) for corners in skin.columns)
    seen = ~(first & second & third)
    return _surface(skin, body, 0)._replace(triangles=skin.triangles.compress(seen, axis=0))


def _garment(assets: Assets, body: Body, garment: Garment, texture: int) -> Corners:
    surface = assets.surfaces[garment.part]
    return _surface(surface, body, texture, garment.offset)._replace(
        uv=surface.points[:, 1:] * _FABRIC_REPEATS,
        closed=garment.part != "skirt",
        cut=edges(garment, surface.points, surface.along_arm),
    )


def edges(garment: Garment, points: Float32Array, along_arm: Float32Array) -> Float32Array:
    """(3, c) signed distances of points on the mean body to a garment's hem, neckline and sleeves, positive inside."""
    height = points[:, 2]
    # A neckline is lower in front, and there it is lowest in the middle.
    chest = np.maximum(points[:, 0], 0) * np.clip(1 - np.abs(points[:, 1]) / 0.07, 0, 1)
    sleeve = 0.19 * (garment.sleeve - along_arm) if garment.sleeve > 0 else 0.5 - along_arm
    inside = [height - garment.lowest, garment.highest - height - garment.neck * chest, sleeve]
    return np.stack(inside).astype(np.float32, copy=False)


def _eyes(assets: Assets, body: Body) -> list[Corners]:
    """Eyeballs, textured by projection along the view."""
    made: list[Corners] = []
    for part in ("left_eye", "right_eye"):
        surface = assets.surfaces[part]
        points = surface.points
        centre = (points.min(axis=0) + points.max(axis=0)) / 2
        radius = float(np.ptp(points[:, 2])) / 2
        uv = 0.5 + (points[:, 1:] - centre[1:]) / (2 * radius)
        made.append(_surface(surface, body, 1)._replace(uv=uv))
    return made


def _lashes(assets: Assets, body: Body) -> Corners:
    return _surface(assets.surfaces["lashes"], body, 2)


def _hair(assets: Assets, body: Body, hair: Hair, texture: int) -> list[Corners]:
    """The scalp, raised, and what falls behind the ears."""
    scalp, long_hair, face = assets.scalp, assets.surfaces["long_hair"], assets.face
    depth = hair_depth(scalp.points, face, hair.length)
    # Thin at the hairline, so that it does not stand off like a cap.
    lift = hair.thickness * np.sqrt(np.clip(depth / 0.02, 0.02, 1))
    made = [_combed(_surface(scalp, body, texture, lift), scalp.points, face, depth)]
    if hair.falls > 0:
        corners = _surface(long_hair, body, texture)._replace(closed=False)
        made.append(_combed(corners, long_hair.points, face, fall_depth(long_hair.points, face, hair.falls)))
    return made


def _combed(corners: Corners, points: Float32Array, face: Float64Array, depth: Float32Array) -> Corners:
    """Strands run down from the crown, and end where `depth` does."""
    around = np.arctan2(points[:, 1], points[:, 0] - face[Joint.LEFT_EAR, 0])
    beyond = np.full_like(depth, _NO_EDGE)
    uv = np.stack([around * 2, points[:, 2] * 6], axis=1)
    return corners._replace(uv=uv, cut=np.stack([depth, beyond, beyond]))


def _join(surfaces: list[Corners], textures: tuple[Levels, ...], joints: Float64Array) -> Person:
    ends = np.cumsum([len(surface.position) for surface in surfaces])
    rows = np.empty((ends[-1], 12), np.float32)
    closed: list[IndexArray] = []
    seen_through: list[IndexArray] = []
    for surface, end in zip(surfaces, ends, strict=True):
        start = end - len(surface.position)
        _write_rows(surface, rows[start:end])
        hides_inside, shows_both = _split(surface)
        closed.append(hides_inside + np.int32(start))
        seen_through.append(shows_both + np.int32(start))
    return Person(rows, np.concatenate(closed), np.concatenate(seen_through), textures, joints)


def _write_rows(surface: Corners, rows: Float32Array) -> None:
    cut = (_NO_EDGE,) * 3 if surface.cut is None else surface.cut
    columns = (*surface.position.T, *surface.normal.T, *surface.uv.T, surface.texture, *cut)
    # Column by column: numpy is slow to go along axes of three.
    for number, column in enumerate(columns):
        rows[:, number] = column


def _split(surface: Corners) -> tuple[IndexArray, IndexArray]:
    """The triangles that lie inside all edges and hide their insides, and the others of which anything is left."""
    triangles = surface.triangles
    outside = np.zeros(len(surface.position), np.uint8)
    for number, distance in enumerate(() if surface.cut is None else surface.cut):
        outside |= (distance < 0).astype(np.uint8) << np.uint8(number)
    first, second, third = (outside.take(corners) for corners in triangles.T)
    kept = (first & second & third) == 0
    hides_inside = ((first | second | third) == 0) & surface.closed
    return triangles.compress(hides_inside, axis=0), triangles.compress(kept & ~hides_inside, axis=0)
