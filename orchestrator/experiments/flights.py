"""Flights along scripted paths with the Kalman filter, which measure the quality of its posterior."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, TypeAlias

import numpy as np
import pyarrow as pa
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.experiments.directory import ExperimentDirectory
from orchestrator.experiments.figures.columns import SCHEMA, joint_columns, table_of
from orchestrator.experiments.parts import Parts
from orchestrator.experiments.qoe import Shot, filter_rule, frame_values, observe_request
from orchestrator.experiments.views import SeededScene, View, ViewSet, family_of, identities_and_poses, scenes_of
from orchestrator.experiments.workers import Rate, WorkerPools
from orchestrator.pictures.view import Viewpoint
from protocol.arrays import AnyArray
from protocol.camera import DepthNoise
from protocol.config import RunConfig
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.messages import Sampled, SampleScene
from protocol.pose_estimate import FilterState, PoseEstimate

Rows: TypeAlias = tuple[Mapping[str, object], Mapping[str, AnyArray]]
Path: TypeAlias = Literal["circle", "front"]
PATHS: tuple[Path, ...] = ("circle", "front")

CIRCLE_DISTANCE = 3.0
STEP = 0.5
"""Metres along the circle between two pictures: half a second at 1 m/s."""

APPROACH_FROM = 6.0
"""Metres from the person at which a flight to the front begins, at their side or behind them."""

AT_ONCE = 4
"""Flights in parallel; a kill loses at most these."""

_START = 0xF117
"""Separates the random stream of a flight's start from others of the same seed."""

SCHEMA_OF_FLIGHTS = pa.schema(
    [
        pa.field("flight", pa.int16(), metadata={"description": "number of the flight, from 0"}),
        pa.field("path", pa.dictionary(pa.int8(), pa.string()), metadata={"description": "circle, or front"}),
        pa.field("step", pa.int16(), metadata={"description": "number of the picture in its flight, from 0"}),
        *SCHEMA,
        pa.field("filter_x", pa.float32(), metadata={"description": "m, the filter's mean after this picture"}),
        pa.field("filter_y", pa.float32(), metadata={"description": "m"}),
        pa.field("filter_z", pa.float32(), metadata={"description": "m"}),
        pa.field("filter_error", pa.float32(), metadata={"description": "m between that and the true joint"}),
        pa.field("deviation", pa.float32(), metadata={"description": "m, root of the posterior's trace"}),
        *(
            pa.field(f"{name}_{axis}", pa.float32(), metadata={"description": words})
            for name, words in (
                ("posterior", "m², the filter's variance along the axis after this picture"),
                ("variance", "m², that a learned lifter gives this picture's estimate; NaN where there is none"),
            )
            for axis in "xyz"
        ),
        pa.field("seen", pa.bool_(), metadata={"description": "whether the filter was ever told of the joint"}),
    ]
)


class FlightSet(Struct, frozen=True, kw_only=True):
    """All flights: every scene is orbited and approached, once with each kind of depth noise.

    Attributes:
        scenes: one for each identity in turn, their poses in turn.
        steps: pictures of each flight.
    """

    scenes: int = 20
    steps: int = 40
    depth_noises: tuple[DepthNoise, ...] = ("none", "d435i")

    def __post_init__(self) -> None:
        if self.scenes < 1 or self.steps < 2 or not self.depth_noises:
            raise InvalidInput("flights are over one scene or more, with two pictures or more each")


class Course(Struct, frozen=True, kw_only=True):
    """One flight: `number` from 0, over which scene, along which path, with which noise."""

    number: int
    scene: int
    path: Path
    depth_noise: DepthNoise


def courses(flights: FlightSet) -> tuple[Course, ...]:
    """Every flight, in order."""
    each = itertools.product(range(flights.scenes), flights.depth_noises, PATHS)
    return tuple(
        Course(number=number, scene=scene, path=path, depth_noise=noise)
        for number, (scene, noise, path) in enumerate(each)
    )


def viewpoints(path: Path, seed: int, scene: int, steps: int, environment: EnvironmentConfig) -> Iterator[Viewpoint]:
    """The viewpoint of each picture of a flight; the seed decides where both paths begin.

    `circle` goes counter-clockwise around the person; `front` comes from the side or from behind to the point in front,
    along a spiral.
    """
    random = np.random.default_rng((seed, scene, _START))
    start, side = float(random.uniform(-180.0, 180.0)), float(random.uniform(90.0, 180.0) * random.choice((-1.0, 1.0)))
    for step in range(steps):
        done = step / (steps - 1)
        if path == "circle":
            distance, angle = CIRCLE_DISTANCE, start + math.degrees(step * STEP / CIRCLE_DISTANCE)
        else:
            distance = APPROACH_FROM + done * (environment.front_distance - APPROACH_FROM)
            angle = side * (1.0 - done)
        wrapped = (angle + 180.0) % 360.0 - 180.0
        yield Viewpoint(distance=distance, angle=wrapped, altitude=environment.front_height)


def flight_parts(directory: ExperimentDirectory, flights: FlightSet) -> Parts:
    """The parts of the flights' table: one for each flight."""
    return Parts(directory.flights_path, len(courses(flights)))


class FlightPools(Struct, frozen=True, eq=False):
    """What all flights of a set share."""

    flights: FlightSet
    views: ViewSet
    config: RunConfig
    workers: WorkerPools
    scenes: Mapping[int, SeededScene]
    rate: Rate

    def way(self, course: Course) -> Iterator[Viewpoint]:
        """The viewpoints of a flight."""
        return viewpoints(course.path, self.views.seed, course.scene, self.flights.steps, self.config.environment)

    def shot(self, course: Course, place: Viewpoint, carried: FilterState | None) -> Shot:
        """The next picture of a flight, with the filter of the last one."""
        one, scene = scene_view(self.views, course.scene, place), self.scenes[course.scene]
        request = observe_request(one, scene, self.config.environment, course.depth_noise, filter_rule(self.config))
        return Shot(one, scene, request if carried is None else replace(request, filter=carried))


def fly(parts: Parts, flights: FlightSet, views: ViewSet, config: RunConfig, workers: WorkerPools) -> None:
    """Fly the missing flights, and write each.

    Raises:
        Interrupted: the command was asked to stop; the whole flights stay.
        CallFailed: a worker could not answer.
    """
    missing = [course for course in courses(flights) if course.number in set(parts.missing())]
    rate = Rate(parts.count * flights.steps, (parts.count - len(missing)) * flights.steps)
    pools = FlightPools(flights, views, config, workers, _scenes(flights, views, workers), rate)
    for begin in range(0, len(missing), AT_ONCE):
        side_by_side = missing[begin : begin + AT_ONCE]
        for course, part in zip(side_by_side, _flown(side_by_side, pools), strict=True):
            parts.write(course.number, part)


def filter_columns(observation: PoseEstimate) -> dict[str, AnyArray]:
    """The filter's state of each joint after a picture, as columns."""
    state = observation.filter
    columns: dict[str, AnyArray] = {f"filter_{axis}": state.mean[:, index] for index, axis in enumerate("xyz")}
    truth = observation.joints if observation.joints is not None else np.full_like(state.mean, np.nan)
    columns["filter_error"] = np.linalg.norm(state.mean - truth, axis=1)
    columns["deviation"] = np.sqrt(state.variance.sum(axis=1))
    columns["seen"] = state.seen
    lifted = np.full_like(state.variance, np.nan) if observation.variance is None else observation.variance
    for name, variance in (("posterior", state.variance), ("variance", lifted)):
        columns |= {f"{name}_{axis}": variance[:, index] for index, axis in enumerate("xyz")}
    return columns


def _scenes(flights: FlightSet, views: ViewSet, workers: WorkerPools) -> Mapping[int, SeededScene]:
    def ask(requests: Sequence[SampleScene]) -> Iterator[Sampled]:
        return workers.answers(workers.renderers, requests, "drawing scenes")

    return scenes_of(
        replace(views, views_a_scene=1), [scene_view(views, scene, Viewpoint()) for scene in range(flights.scenes)], ask
    )


def scene_view(views: ViewSet, scene: int, viewpoint: Viewpoint) -> View:
    """A view of scene number `scene`: identities and poses in turn, so that twenty scenes have all of both."""
    identities, kinds = identities_and_poses(views.split)
    families = views.poses == "families"
    return View(
        number=scene,
        identity=identities[scene % len(identities)],
        kind=0 if families else kinds[scene % len(kinds)],
        viewpoint=viewpoint,
        poses=family_of(scene, views.split) if families else "kinds",
    )


def _flown(side_by_side: Sequence[Course], pools: FlightPools) -> Iterator[pa.Table]:
    """The tables of flights that are flown in parallel."""
    capabilities = pools.workers.capabilities()
    filters: dict[int, FilterState] = {}
    rows: dict[int, list[Rows]] = {course.number: [] for course in side_by_side}
    for step, places in enumerate(zip(*map(pools.way, side_by_side), strict=True)):
        shots = [
            pools.shot(course, place, filters.get(course.number))
            for course, place in zip(side_by_side, places, strict=True)
        ]
        requests = [shot.request for shot in shots]
        answers = pools.workers.answers(pools.workers.perceivers, requests, "flying", pools.rate)
        for course, shot, observation in zip(side_by_side, shots, answers, strict=True):
            filters[course.number] = observation.filter
            own: dict[str, object] = {"flight": course.number, "path": course.path, "step": step}
            joints = joint_columns(shot.request, observation) | filter_columns(observation)
            rows[course.number].append((own | frame_values(shot, capabilities), joints))
            pools.rate.advance()
    for course in side_by_side:
        yield table_of(rows[course.number], SCHEMA_OF_FLIGHTS)
