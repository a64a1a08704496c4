"""From the body frame to the world frame."""

import math

import numpy as np

from protocol.arrays import Float64Array
from protocol.scene import Figure
from render_worker.people.person import Person


def place_person(person: Person, figure: Figure) -> Person:
    """The person's corners where the scene has them stand."""
    turn, shift = _turn(figure), np.array([*figure.position, 0.0])
    corners = person.corners.copy()
    corners[:, 0:3] = person.corners[:, 0:3] @ turn.T + shift
    corners[:, 3:6] = person.corners[:, 3:6] @ turn.T
    return person._replace(corners=corners)


def place_joints(joints: Float64Array, figure: Figure) -> Float64Array:
    """(18, 3) joints of the body frame in the world frame."""
    return joints @ _turn(figure).T + np.array([*figure.position, 0.0])


def _turn(figure: Figure) -> Float64Array:
    cosine, sine = math.cos(figure.yaw), math.sin(figure.yaw)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
