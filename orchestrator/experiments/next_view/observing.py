"""Has the workers observe the arrays of the experiment, part by part."""

from collections.abc import Iterator, Sequence
from itertools import islice

from msgspec import Struct

from orchestrator.experiments.next_view.columns import array_rows, table_of
from orchestrator.experiments.next_view.views import (
    CELLS,
    CENTRE,
    ArrayPart,
    ArrayViews,
    array_cameras,
    centre_of,
    scene_views,
)
from orchestrator.experiments.parts import Parts
from orchestrator.experiments.qoe import filter_rule
from orchestrator.experiments.views import SeededScene, scenes_of
from orchestrator.experiments.workers import Rate, WorkerPools
from protocol.camera import Camera
from protocol.config import RunConfig, settled
from protocol.messages import Observe, Render, Sampled, SampleScene
from protocol.pose_estimate import FilterState

_ACTIVITY = "observing arrays of cameras"


class _Array(Struct, frozen=True, eq=False):
    """A scene, its number in its split, and its cameras in the order of `CELLS`."""

    number: int
    scene: SeededScene
    cameras: tuple[Camera, ...]


def observe_arrays(parts: Parts, views: ArrayViews, config: RunConfig, workers: WorkerPools) -> None:
    """Observe the scenes of every missing part, and write each part.

    Raises:
        Interrupted: the command was asked to stop; the whole parts stay.
        CallFailed: a worker could not answer.
        InvalidInput: the draws have too few poses of some kind, or the workers are of another version.
    """
    missing = {number: views.parts[number] for number in parts.missing()}
    to_do = len(CELLS) * sum(len(part.scenes) for part in missing.values())
    observer = _Observer(views, config, workers, Rate(views.count, views.count - to_do))
    for number, part in missing.items():
        parts.write(number, table_of([row for rows in observer.observe(part) for row in rows]))


class _Observer(Struct, frozen=True, eq=False):
    """Has the scenes of a part observed; the errors are those of `WorkerPools.wait_for` as well."""

    views: ArrayViews
    config: RunConfig
    workers: WorkerPools
    rate: Rate

    def observe(self, part: ArrayPart) -> Iterator[list[dict[str, object]]]:
        """The rows of each scene."""
        arrays = self._arrays(part)
        filters = self._filters(arrays)
        requests = (
            Observe(scene=one.scene.scene, camera=camera, filter=belief, truth=True, evidence=True)
            for one, belief in zip(arrays, filters, strict=True)
            for camera in one.cameras
        )
        answers = self.workers.answers(self.workers.perceivers, requests, _ACTIVITY, self.rate)
        pictures = (Render(scene=one.scene.scene, camera=one.cameras[CENTRE]) for one in arrays)
        frames = self.workers.answers(self.workers.renderers, pictures, _ACTIVITY, self.rate)
        for one in arrays:
            estimates = list(islice(answers, len(CELLS)))
            yield array_rows(one.number, part.split, one.scene, one.cameras, estimates, next(frames).rgb)
            for _ in CELLS:
                self.rate.advance()

    def _arrays(self, part: ArrayPart) -> list[_Array]:
        drawn, firsts = scene_views(self.views, part)
        scenes = scenes_of(drawn, firsts, self._sampled)
        return [self._array(part, number, scenes[one.number]) for number, one in zip(part.scenes, firsts, strict=True)]

    def _array(self, part: ArrayPart, number: int, scene: SeededScene) -> _Array:
        centre = centre_of(self.views, part.split, number)
        return _Array(number, scene, array_cameras(centre, self.views.spacing, scene.scene, self.config.environment))

    def _filters(self, arrays: Sequence[_Array]) -> list[FilterState]:
        """The filter before each scene's views: where workers track, it knows the person by the centre's picture."""
        initial = [self._initial(one) for one in arrays]
        if settled(self.config.perception, self.config.profile).look != "track":
            return initial
        requests = (
            Observe(scene=one.scene.scene, camera=one.cameras[CENTRE], filter=belief)
            for one, belief in zip(arrays, initial, strict=True)
        )
        answers = self.workers.answers(self.workers.perceivers, requests, _ACTIVITY, self.rate)
        return [answer.filter for answer in answers]

    def _initial(self, one: _Array) -> FilterState:
        chest = (*one.scene.scene.position, self.config.environment.target_height)
        return FilterState.initial(chest, filter_rule(self.config))

    def _sampled(self, requests: Sequence[SampleScene]) -> Iterator[Sampled]:
        return self.workers.answers(self.workers.renderers, requests, _ACTIVITY, self.rate)
