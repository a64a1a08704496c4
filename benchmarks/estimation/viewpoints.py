"""Cameras around test scenes, drawn from a seed, and where each would have been a step before."""

from collections.abc import Iterable, Iterator

import numpy as np
from msgspec.structs import replace

from orchestrator.pictures.view import Viewpoint, a_step_before, camera_at
from orchestrator.pictures.worker_pair import WorkerPair
from protocol.environment_config import EnvironmentConfig
from protocol.messages import Observe, SampleScene
from protocol.pose_estimate import FilterState
from protocol.scene import Split


def front_views(seed: int) -> Iterator[Viewpoint]:
    """Views of the front half of a person, 1.5 to 4 m away and 1 to 2.5 m high."""
    rng = np.random.default_rng(seed)
    while True:
        yield Viewpoint(distance=rng.uniform(1.5, 4.0), angle=rng.uniform(-90.0, 90.0), altitude=rng.uniform(1.0, 2.5))


def all_views(seed: int, farthest: float = 6.0) -> Iterator[Viewpoint]:
    """Views from all around a person, from 1.5 m away to `farthest`, and 1 to 2.5 m high."""
    rng = np.random.default_rng(seed)
    while True:
        yield Viewpoint(
            distance=rng.uniform(1.5, farthest), angle=rng.uniform(-180.0, 180.0), altitude=rng.uniform(1.0, 2.5)
        )


def requests_before(requests: Iterable[Observe], environment: EnvironmentConfig, seed: int) -> Iterator[Observe]:
    """For each request the one that a flying drone would have made a step before, without the truth."""
    rng = np.random.default_rng(seed)
    for request in requests:
        yield replace(request, camera=a_step_before(request.camera, environment, rng), truth=False)


def observe_requests(
    pair: WorkerPair, viewpoints: Iterator[Viewpoint], count: int, environment: EnvironmentConfig, split: Split = "test"
) -> Iterator[Observe]:
    """One request for each of `count` scenes, seen from the next viewpoint, with the truth asked for."""
    for seed, viewpoint in zip(range(count), viewpoints, strict=False):
        scene = pair.renderer.call(SampleScene(seed=seed, split=split)).scene
        yield Observe(
            scene=scene,
            camera=camera_at(viewpoint, scene, environment),
            filter=FilterState.initial((*scene.position, environment.target_height)),
            truth=True,
        )
