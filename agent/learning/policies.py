"""Policies that fly drones: a learner's, or one of the scripted baselines.

A policy gives the velocities of several drones at once. It gets the learner's observations and the flights: baselines
know the person's place, and `front` even the direction they face. A velocity of a baseline depends on its own flight
alone, so a flight is the same whatever flies beside it.
"""

import math
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from agent.environment.flight import Flight
from agent.environment.reward import front_point
from agent.learning.learner import ActionArray, Learner
from protocol.arrays import Float32Array, Float64Array
from protocol.camera import Vector3
from protocol.environment_config import MAX_SPEED, EnvironmentConfig

Policy: TypeAlias = Callable[[Float32Array, Sequence[Flight]], ActionArray]
"""Observations (n, 111) and the n flights that they are of, to velocities (n, 3) in m/s."""

_Pilot: TypeAlias = Callable[[EnvironmentConfig, Flight], Float64Array]

_CLEARANCE = 0.5
"""Metres kept from the keep-out on the way around the person."""

_RANDOM, _NOISE, _WILDNESS = 0x4A2D, 0x2015E, 0x317D
"""Keep the random streams of policies apart from others with the same seed."""


def learned(learner: Learner) -> Policy:
    """A learner's policy without exploration."""
    return lambda observations, flights: learner.act(observations, explore=False)


def baseline(name: str, config: EnvironmentConfig) -> Policy:
    """One of `BASELINES`."""
    pilot = BASELINES[name]
    return lambda observations, flights: np.stack([pilot(config, flight) for flight in flights]).astype(np.float32)


def scripted(config: EnvironmentConfig, noise: float) -> Policy:
    """Flights to the front with normal noise on each velocity, to fill a replay memory with.

    Every flight has a standard deviation of its own, up to `noise` m/s: steady ones show what pays, wild ones what a
    crash costs.
    """

    def fly(observations: Float32Array, flights: Sequence[Flight]) -> Float32Array:
        velocities = [front(config, flight) + _noise(flight, noise) for flight in flights]
        return np.clip(velocities, -MAX_SPEED, MAX_SPEED).astype(np.float32)

    return fly


def stay(config: EnvironmentConfig, flight: Flight) -> Float64Array:
    """Hover where the flight began."""
    return np.zeros(3)


def random(config: EnvironmentConfig, flight: Flight) -> Float64Array:
    """Any velocity, a new one each step."""
    return _rng(flight, _RANDOM).uniform(-MAX_SPEED, MAX_SPEED, 3)


def circle(config: EnvironmentConfig, flight: Flight) -> Float64Array:
    """Around the person at the distance of the front point, counter-clockwise. Source: thesis, section 4.1.1."""
    x, y = np.array(flight.position[:2]) - flight.scene.position
    ahead = math.atan2(y, x) + MAX_SPEED * config.step_duration / config.front_distance
    goal_x = flight.scene.position[0] + config.front_distance * math.cos(ahead)
    goal_y = flight.scene.position[1] + config.front_distance * math.sin(ahead)
    return steered(config, flight, (goal_x, goal_y, config.front_height))


def front(config: EnvironmentConfig, flight: Flight) -> Float64Array:
    """Straight to the point in front of the person, around the keep-out; knows the scene, as no drone does."""
    return steered(config, flight, front_point(config, flight.scene))


BASELINES: dict[str, _Pilot] = {"stay": stay, "random": random, "circle": circle, "front": front}


def steered(config: EnvironmentConfig, flight: Flight, goal: Vector3) -> Float64Array:
    """The velocity that takes a drone to `goal` as fast as it can, and around the person where they are in the way.

    Going around keeps to the tangent of a circle of half a metre outside the keep-out.
    """
    to_goal = np.array(goal) - flight.position
    to_person = np.array(flight.scene.position) - flight.position[:2]
    to_goal[:2] = _around(to_goal[:2], to_person, config.keep_out_radius + _CLEARANCE)
    velocity = to_goal / config.step_duration
    return velocity * min(1.0, MAX_SPEED / max(float(np.abs(velocity).max()), 1e-9))


def _around(way: Float64Array, to_person: Float64Array, clearance: float) -> Float64Array:
    """`way` (2,) itself if it stays clear of the person, else one as long along the tangent on the goal's side."""
    length = float(np.linalg.norm(way))
    distance = float(np.linalg.norm(to_person))
    along = float(np.clip(way @ to_person / max(length, 1e-9), 0.0, length))
    nearest = way * (along / max(length, 1e-9))
    if np.linalg.norm(to_person - nearest) >= min(clearance, distance) - 1e-9:
        return way
    side = 1.0 if to_person[0] * way[1] - to_person[1] * way[0] >= 0 else -1.0
    turn = side * math.asin(min(1.0, clearance / distance))
    cosine, sine = math.cos(turn), math.sin(turn)
    x, y = to_person / distance * length
    return np.array([cosine * x - sine * y, sine * x + cosine * y])


def _noise(flight: Flight, most: float) -> Float64Array:
    deviation = most * np.random.default_rng((flight.seed, _WILDNESS)).random()
    return deviation * _rng(flight, _NOISE).normal(size=3)


def _rng(flight: Flight, stream: int) -> np.random.Generator:
    return np.random.default_rng((flight.seed, flight.steps, stream))
