"""Rotations as (3, 3) matrices that turn column vectors."""

import numpy as np
from numpy.typing import ArrayLike

from protocol.arrays import Float64Array


def rotation(vector: ArrayLike) -> Float64Array:
    """The rotation about `vector` (3,) by its length in radians (Rodrigues)."""
    turn = np.asarray(vector, float)
    angle = float(np.linalg.norm(turn))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = turn / angle
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew


def rotation_vector(matrix: Float64Array) -> Float64Array:
    """The axis times the angle, in [0, π], of a rotation; the inverse of `rotation`."""
    angle = float(np.arccos(np.clip((np.trace(matrix) - 1) / 2, -1, 1)))
    axis = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    sine = float(np.linalg.norm(axis))
    return np.zeros(3) if sine < 1e-9 else axis / sine * angle


def shortest_turn(start: Float64Array, end: Float64Array) -> Float64Array:
    """The rotation by the smallest angle that takes the direction `start` (3,) to `end` (3,)."""
    a, b = start / np.linalg.norm(start), end / np.linalg.norm(end)
    axis = cross(a, b)
    sine = float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, a @ b))
    return np.eye(3) if sine < 1e-9 else rotation(axis / sine * angle)


def frame(along: Float64Array, across: Float64Array) -> Float64Array:
    """Orthonormal axes (3, 3) as columns: the first along `along`, the second as near to `across` as can be."""
    first = along / np.linalg.norm(along)
    second = across - (across @ first) * first
    second /= np.linalg.norm(second)
    return np.stack([first, second, cross(first, second)], axis=1)


def cross(one: Float64Array, other: Float64Array) -> Float64Array:
    """The cross product of two vectors (3,): `np.cross`, to the bit, without what it takes to serve any shape."""
    (a, b, c), (x, y, z) = one.tolist(), other.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])
