"""Observes the views of a fit by the workers, part by part."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.experiments.parts import Parts
from orchestrator.experiments.workers import Rate, WorkerPools
from orchestrator.lifter.obstacle import hide_behind_board
from orchestrator.lifter.table import row_of, table_of
from orchestrator.lifter.views import (
    FitView,
    FitViews,
    believed,
    camera_of,
    company_of,
    fit_view,
    identity_of,
    scene_request,
)
from protocol.arrays import Float64Array
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.messages import Observe, Perceive, Render
from protocol.scene import Scene

_ACTIVITY = "observing train people"

_GLANCE = Intrinsics.from_horizontal_fov(16, 16, 70.0)
"""The smallest picture, since only its truth is used."""


class _Subject(Struct, frozen=True, eq=False):
    """A scene, the set of its poses, and the person's joints, (18, 3) in the world frame, metres."""

    scene: Scene
    poses: str
    joints: Float64Array


class _Shot(Struct, frozen=True, eq=False):
    view: FitView
    subject: _Subject
    request: Observe


def observe_fit_views(parts: Parts, views: FitViews, environment: EnvironmentConfig, workers: WorkerPools) -> None:
    """Observe the views of every missing part, and write each part.

    Raises:
        Interrupted: the command was asked to stop; the whole parts stay.
        CallFailed: a worker could not answer.
    """
    missing = parts.missing()
    numbers = {part: _numbers(part, views) for part in missing}
    to_do = sum(map(len, numbers.values()))
    rate = Rate(views.frames, views.frames - to_do)
    for part in missing:
        shots = list(_shots(views, numbers[part], environment, workers, rate))
        requests = (_asked(views, shot, workers, rate) for shot in shots)
        rows: list[Mapping[str, object]] = []
        for shot, observation in zip(
            shots, workers.answers(workers.perceivers, requests, _ACTIVITY, rate), strict=True
        ):
            request = shot.request
            rows.append(row_of(shot.view, shot.subject.poses, request.scene, request.camera, observation))
            rate.advance()
        parts.write(part, table_of(rows))


def _numbers(part: int, views: FitViews) -> range:
    return range(part * views.frames_a_part, min((part + 1) * views.frames_a_part, views.frames))


def _shots(
    views: FitViews, numbers: range, environment: EnvironmentConfig, workers: WorkerPools, rate: Rate
) -> Iterator[_Shot]:
    first, last = (number // views.views_a_scene for number in (numbers[0], numbers[-1]))
    subjects = dict(zip(range(first, last + 1), _subjects(views, range(first, last + 1), workers, rate), strict=True))
    for number in numbers:
        view, subject = fit_view(views, number), subjects[number // views.views_a_scene]
        camera = camera_of(view, subject.scene, environment)
        state = believed(views, view, subject.joints, subject.scene, environment.target_height)
        scene = company_of(views, view, subject.scene, camera)
        request = Observe(scene=scene, camera=camera, filter=state, truth=True, evidence=True)
        yield _Shot(view, subject, request)


def _subjects(views: FitViews, numbers: Sequence[int], workers: WorkerPools, rate: Rate) -> Iterator[_Subject]:
    requests = [scene_request(views, number) for number in numbers]
    sampled = workers.answers(workers.renderers, requests, _ACTIVITY, rate)
    scenes = [replace(one.scene, identity=identity_of(number)) for number, one in zip(numbers, sampled, strict=True)]
    glances = (Render(scene=_alone(scene), camera=_glance_at(scene), truth=True) for scene in scenes)
    frames = workers.answers(workers.renderers, glances, _ACTIVITY, rate)
    for request, scene, frame in zip(requests, scenes, frames, strict=True):
        if frame.joints is None:
            raise InvalidInput("a frame came without the truth; is the render worker of this version?")
        yield _Subject(scene, request.poses, frame.joints)


def _alone(scene: Scene) -> Scene:
    return replace(scene, bystanders=())


def _glance_at(scene: Scene) -> Camera:
    x, y = scene.position
    return Camera(CameraPose((x + 3.0, y, 1.5), (x, y, 1.0)), _GLANCE)


def _asked(views: FitViews, shot: _Shot, workers: WorkerPools, rate: Rate) -> Observe | Perceive:
    """The request to a perception worker: observe a view, or perceive a frame with an obstacle painted into it."""
    request = shot.request
    if not shot.view.hidden:
        return request
    rendered = workers.renderers.submit(Render(scene=request.scene, camera=request.camera, truth=True))
    frame = workers.wait_for(rendered, _ACTIVITY, rate)
    random = np.random.default_rng((views.seed, shot.view.number, 4))
    return Perceive(frame=hide_behind_board(frame, shot.subject.joints, random), filter=request.filter, evidence=True)
