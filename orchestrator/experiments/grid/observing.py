"""Has the workers observe the environments of a grid table."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice

import numpy as np
from msgspec import Struct

from orchestrator.experiments.grid.columns import part_of
from orchestrator.experiments.grid.observed import ObservedEnvironment, observed
from orchestrator.experiments.grid.views import (
    GLANCE_ANGLES,
    OBSERVED_CELLS,
    GridViews,
    camera_in,
    draws_of,
    glance_camera,
    place_of,
    subject_of,
    with_identity,
)
from orchestrator.experiments.parts import Parts
from orchestrator.experiments.qoe import filter_rule
from orchestrator.experiments.workers import Rate, WorkerPools
from protocol.arrays import Float64Array, UInt8Array
from protocol.config import RunConfig, settled
from protocol.errors import InvalidInput
from protocol.grid.table import GridPlace
from protocol.messages import Observe, Render
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.scene import Scene

_ACTIVITY = "observing the cells of the grid"

_PICTURES = "taking pictures from the cells of the grid"

_AT_ONCE = 4
"""Environments that are made ready in a row, so that no worker waits; a render worker keeps more scenes than these."""

_DRAWS, _MOST_DRAWS = 16, 1600
"""Scenes drawn in a row, and before giving up on one with the wanted pose; one in six or eight has it."""

_ENOUGH_JOINTS = 6
"""Joints in a first picture by which a filter knows the person."""


class _Drawn(Struct, frozen=True):
    """An environment and its scene."""

    place: GridPlace
    scene: Scene


def observe_parts(parts: Parts, views: GridViews, config: RunConfig, workers: WorkerPools) -> None:
    """Observe every missing environment, and write each as a part.

    Raises:
        Interrupted: the command was asked to stop; the whole parts stay.
        CallFailed: a worker could not answer.
        InvalidInput: as `GridObserver.observe`.
    """
    missing = parts.missing()
    each = len(OBSERVED_CELLS)
    rate = Rate(each * views.count, each * (views.count - len(missing)))
    observer = GridObserver(views, config, workers, rate)
    for number, one in zip(missing, observer.observe(missing), strict=True):
        parts.write(number, part_of(number, one))


class GridObserver:
    """Has environments observed; the errors of its methods are those of `WorkerPools.wait_for` as well."""

    def __init__(self, views: GridViews, config: RunConfig, workers: WorkerPools, rate: Rate) -> None:
        self._views = views
        self._config = config
        self._workers = workers
        self._rate = rate

    def observe(self, numbers: Sequence[int]) -> Iterator[ObservedEnvironment]:
        """The environments of these numbers, in order.

        Raises:
            InvalidInput: no scene has the wanted pose, or the workers are of another version.
        """
        for first in range(0, len(numbers), _AT_ONCE):
            yield from self._observe_drawn([self._draw(number) for number in numbers[first : first + _AT_ONCE]])

    def pictures(self, number: int, cells: Sequence[int]) -> Iterator[UInt8Array]:
        """What the camera sees from cells of an environment, (h, w, 3) each; errors as `observe`."""
        scene = self._draw(number).scene
        requests = [
            Render(scene=scene, camera=camera_in(cell, self._views, scene, self._config.environment)) for cell in cells
        ]
        for frame in self._workers.answers(self._workers.renderers, requests, _PICTURES, self._rate):
            self._rate.advance()
            yield frame.rgb

    def _draw(self, number: int) -> _Drawn:
        subject = subject_of(self._views, number)
        draws = draws_of(self._views, subject)
        for _ in range(_MOST_DRAWS // _DRAWS):
            requests = list(islice(draws, _DRAWS))
            answers = list(self._workers.answers(self._workers.renderers, requests, _ACTIVITY, self._rate))
            for request, answer in zip(requests, answers, strict=True):
                if answer.scene.pose.kind == subject.kind:
                    scene = with_identity(answer.scene, subject)
                    return _Drawn(place_of(subject, request.seed, scene), scene)
        raise InvalidInput(f"of {_MOST_DRAWS} scenes of {subject.split} none has pose {subject.kind}")

    def _observe_drawn(self, drawn: Sequence[_Drawn]) -> Iterator[ObservedEnvironment]:
        first = self._first_pictures([one.scene for one in drawn])
        # All views of an environment in a row, so that a render worker prepares its scene once.
        requests = (
            self._cell_request(one.scene, cell, filter_state)
            for one, filter_state in zip(drawn, self._filters(drawn, first), strict=True)
            for cell in OBSERVED_CELLS
        )
        answers = self._answers(requests)
        for one, picture in zip(drawn, first, strict=True):
            estimates: list[PoseEstimate] = []
            for estimate in islice(answers, len(OBSERVED_CELLS)):
                estimates.append(estimate)
                self._rate.advance()
            yield observed(one.place, one.scene, _joints(picture), estimates)

    def _first_pictures(self, scenes: Sequence[Scene]) -> list[PoseEstimate]:
        """Of each scene the first picture in which the person is found, or else the last; with the truth."""
        found: dict[int, PoseEstimate] = {}
        for angle in GLANCE_ANGLES:
            left = [number for number in range(len(scenes)) if number not in found or not _knows(found[number])]
            requests = [self._first_request(scenes[number], angle) for number in left]
            found |= dict(zip(left, self._answers(requests), strict=True))
        return [found[number] for number in range(len(scenes))]

    def _filters(self, drawn: Sequence[_Drawn], first: Sequence[PoseEstimate]) -> Iterator[FilterState]:
        """The filter before each view of an environment: where workers track, it knows the person by a picture."""
        tracks = settled(self._config.perception, self._config.profile).look == "track"
        for one, picture in zip(drawn, first, strict=True):
            yield picture.filter if tracks and _knows(picture) else self._initial_filter(one.scene)

    def _first_request(self, scene: Scene, angle: float) -> Observe:
        camera = glance_camera(angle, self._views, scene, self._config.environment)
        return Observe(scene=scene, camera=camera, filter=self._initial_filter(scene), truth=True)

    def _cell_request(self, scene: Scene, cell: int, filter_state: FilterState) -> Observe:
        camera = camera_in(cell, self._views, scene, self._config.environment)
        return Observe(scene=scene, camera=camera, filter=filter_state)

    def _initial_filter(self, scene: Scene) -> FilterState:
        chest = (*scene.position, self._config.environment.target_height)
        return FilterState.initial(chest, filter_rule(self._config))

    def _answers(self, requests: Iterable[Observe]) -> Iterator[PoseEstimate]:
        return self._workers.answers(self._workers.perceivers, requests, _ACTIVITY, self._rate)


def _knows(picture: PoseEstimate) -> bool:
    return int(np.isfinite(picture.keypoints[:, 0]).sum()) >= _ENOUGH_JOINTS


def _joints(picture: PoseEstimate) -> Float64Array:
    if picture.joints is None:
        raise InvalidInput("an observation came without the truth; are the workers of this version?")
    return picture.joints
