"""The experiment on the quality of estimation: observes many views, and compares each joint with the truth."""

from collections.abc import Iterator, Mapping, Sequence

import msgspec
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.experiments.directory import ExperimentDirectory
from orchestrator.experiments.figures.columns import LIFTINGS, joint_columns, table_of
from orchestrator.experiments.parts import Parts
from orchestrator.experiments.views import SeededScene, View, ViewSet, camera_of, scenes_of, view
from orchestrator.experiments.views_directory import what_counts
from orchestrator.experiments.workers import Rate, WorkerPools
from orchestrator.pictures.view import a_step_before
from orchestrator.run.config_toml import plain_toml
from orchestrator.run.versions import Versions
from protocol.camera import DepthNoise
from protocol.config import RunConfig, settled
from protocol.environment_config import EnvironmentConfig
from protocol.messages import Observe, Sampled, SampleScene
from protocol.pose_estimate import FilterRule, FilterState, PoseEstimate

_BEFORE = 0xBEF0
"""Separates the random stream of the position before a view from the view's own."""


class Shot(Struct, frozen=True, eq=False):
    """One picture to take of a view."""

    view: View
    scene: SeededScene
    request: Observe


def table_parts(directory: ExperimentDirectory, views: ViewSet) -> Parts:
    """The parts of the experiment's table."""
    return Parts(directory.table_path, -(-views.frames // views.frames_a_part))


def observe_views(parts: Parts, views: ViewSet, config: RunConfig, workers: WorkerPools) -> None:
    """Observe the views of every missing part, and write each part.

    Raises:
        Interrupted: the command was asked to stop; the whole parts stay.
        CallFailed: a worker could not answer.
    """
    missing = parts.missing()
    numbers = {part: _numbers(part, views) for part in missing}
    each = len(views.depth_noises)
    to_do = each * sum(map(len, numbers.values()))
    rate = Rate(each * views.frames, each * views.frames - to_do)
    capabilities = workers.capabilities()
    for part in missing:
        rows = []
        for shot, observation in _observed([view(views, n) for n in numbers[part]], views, config, workers, rate):
            rows.append((frame_values(shot, capabilities), joint_columns(shot.request, observation)))
            rate.advance()
        parts.write(part, table_of(rows))


def provenance(config: RunConfig, views: Struct, versions: Versions, capabilities: Mapping[str, str]) -> dict[str, str]:
    """How a table was made, as its metadata; it does not depend on when or where."""
    return {
        "vantage.config": plain_toml(what_counts(config)).decode(),
        "vantage.views": msgspec.json.encode(views).decode(),
        "vantage.version": versions.vantage,
        "vantage.packages": msgspec.json.encode(versions.packages, order="deterministic").decode(),
        "vantage.perception": msgspec.json.encode(dict(capabilities), order="deterministic").decode(),
    }


def frame_values(shot: Shot, capabilities: Mapping[str, str]) -> dict[str, object]:
    """The columns with one value for each frame."""
    viewpoint, camera = shot.view.viewpoint, shot.request.camera
    values: dict[str, object] = {
        "frame": shot.view.number,
        "seed": shot.scene.seed,
        "identity": shot.view.identity,
        "pose": shot.view.kind,
        "poses": shot.view.poses,
        "distance": viewpoint.distance,
        "azimuth": viewpoint.angle,
        "altitude": viewpoint.altitude,
        "depth_noise": camera.depth_noise,
        "network": capabilities.get("network", ""),
        "lifting": capabilities.get("lifting", ""),
    }
    for name, point in (("camera", camera.pose.position), ("target", camera.pose.target)):
        values |= {f"{name}_{axis}": value for axis, value in zip("xyz", point, strict=True)}
    return values


def observe_request(
    one: View,
    scene: SeededScene,
    environment: EnvironmentConfig,
    depth_noise: DepthNoise = "none",
    rule: FilterRule = "quality",
) -> Observe:
    """The request to a perception worker for a view."""
    return Observe(
        scene=scene.scene,
        camera=camera_of(one, scene.scene, environment, depth_noise),
        filter=FilterState.initial((*scene.scene.position, environment.target_height), rule),
        truth=True,
        liftings=LIFTINGS,
    )


def filter_rule(config: RunConfig) -> FilterRule:
    """The rule of a flying drone's filter: by variance with a learned lifter, otherwise by quality."""
    return "variance" if settled(config.perception, config.profile).lifting == "learned" else "quality"


def _numbers(part: int, views: ViewSet) -> range:
    return range(part * views.frames_a_part, min((part + 1) * views.frames_a_part, views.frames))


def _observed(
    chosen: Sequence[View], views: ViewSet, config: RunConfig, workers: WorkerPools, rate: Rate
) -> Iterator[tuple[Shot, PoseEstimate]]:
    activity = f"observing {views.split} people"

    def ask(requests: Sequence[SampleScene]) -> Iterator[Sampled]:
        return workers.answers(workers.renderers, requests, activity, rate)

    scenes = scenes_of(views, chosen, ask)
    shots = [
        Shot(one, scenes[one.number], observe_request(one, scenes[one.number], config.environment, noise))
        for one in chosen
        for noise in views.depth_noises
    ]
    if settled(config.perception, config.profile).look == "track":
        befores = (request_before(views, shot, config.environment) for shot in shots)
        seen = list(workers.answers(workers.perceivers, befores, activity, rate))
        shots = [_after(shot, one.filter) for shot, one in zip(shots, seen, strict=True)]
    answers = workers.answers(workers.perceivers, (shot.request for shot in shots), activity, rate)
    yield from zip(shots, answers, strict=True)


def request_before(views: ViewSet, shot: Shot, environment: EnvironmentConfig) -> Observe:
    """The request of a flying drone one step before a picture, which gives the picture a realistic filter."""
    random = np.random.default_rng((views.seed, shot.view.number, _BEFORE))
    camera = a_step_before(shot.request.camera, environment, random)
    return replace(shot.request, camera=camera, truth=False, liftings=())


def _after(shot: Shot, state: FilterState) -> Shot:
    return replace(shot, request=replace(shot.request, filter=state))
