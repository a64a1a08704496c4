"""The lifter that ships, on real renders of people it has not seen: what it must never get wrong.

How good it is, is measured on thousands of views: docs/results.md.
"""

from collections.abc import Callable

import numpy as np
import pytest
from msgspec.structs import replace

from orchestrator.pictures.view import Viewpoint, camera_at
from perception_worker.perceive import Perceiver
from perception_worker.worker import open_perceiver
from protocol.config import PerceptionConfig, RenderConfig, settled
from protocol.environment_config import EnvironmentConfig
from protocol.frame import Frame
from protocol.pose_estimate import FilterState, PoseEstimate
from render_worker.renderer import open_renderer
from render_worker.scenes import sample_scene

pytestmark = pytest.mark.slow

VIEWS = 24


@pytest.fixture(scope="module")
def perceiver() -> Perceiver:
    return open_perceiver(settled(PerceptionConfig(), "vantage"))


@pytest.fixture(scope="module")
def frames() -> list[Frame]:
    """Of test identities in all poses, 2 to 8 m away, from all around."""
    renderer, environment = open_renderer(RenderConfig()), EnvironmentConfig()
    frames = []
    for number in range(VIEWS):
        scene = sample_scene(1000 + number, "test")
        place = Viewpoint(distance=2.0 + 6.0 * number / VIEWS, angle=number * 97.0 % 360.0 - 180.0, altitude=1.6)
        frames.append(renderer.render(scene, camera_at(place, scene, environment), truth=True))
    renderer.close()
    return frames


def known(frame: Frame) -> FilterState:
    """A filter that has followed the person."""
    assert frame.joints is not None
    state = FilterState.initial()
    return replace(state, mean=frame.joints, variance=np.full((18, 3), 0.01), seen=np.ones(18, bool))


def looked_at(
    perceiver: Perceiver, frames: list[Frame], change: Callable[[Frame], Frame] = lambda frame: frame
) -> list[tuple[Frame, PoseEstimate]]:
    return [(frame, perceiver.perceive(change(frame), known(frame))) for frame in frames]


def errors(looks: list[tuple[Frame, PoseEstimate]]) -> np.ndarray:
    return np.array([np.linalg.norm(seen.points - frame.joints, axis=1) for frame, seen in looks])


def with_depth(depth: float, rows: slice = slice(None)) -> Callable[[Frame], Frame]:
    def change(frame: Frame) -> Frame:
        measured = frame.depth.copy()
        measured[rows] = depth
        return replace(frame, depth=measured)

    return change


def test_it_places_joints_to_some_centimetres_and_says_so(perceiver, frames):
    looks = looked_at(perceiver, frames)
    found = np.array([np.isfinite(seen.keypoints[:, 0]) for _, seen in looks])
    radius = np.array([seen.radius for _, seen in looks])
    error = errors(looks)
    assert np.median(error[found]) < 0.05
    assert np.median(error[~found]) < 0.15
    assert np.median(radius[found]) < 0.12
    assert (error <= radius).mean() > 0.7


@pytest.mark.parametrize("depth", [np.nan, 0.0, np.inf, 20.0])
def test_without_any_depth_it_is_never_sure(perceiver, frames, depth):
    looks = looked_at(perceiver, frames, with_depth(depth))
    radius = np.array([seen.radius for _, seen in looks])
    assert np.isfinite(radius).all()
    assert np.median(radius) >= 0.5
    assert (errors(looks) <= radius).mean() > 0.7


def test_with_half_of_the_depth_it_is_as_good_as_its_word(perceiver, frames):
    looks = looked_at(perceiver, frames, with_depth(np.nan, slice(None, None, 2)))
    radius = np.array([seen.radius for _, seen in looks])
    assert (errors(looks) <= radius).mean() > 0.7


def test_a_body_that_the_picture_s_edge_cuts_has_joints_beyond_it(perceiver, frames):
    frame = frames[0]
    left = int(np.nanmedian(perceiver.perceive(frame, known(frame)).keypoints[:, 0]))
    cut = replace(frame, rgb=frame.rgb.copy(), depth=frame.depth.copy())
    cut.rgb[:, : left - 2], cut.depth[:, : left - 2] = 0, np.nan
    seen = perceiver.perceive(cut, known(frame))
    if np.isfinite(seen.keypoints[:, 0]).sum() >= 3:
        assert np.isfinite(seen.points).all()
        assert np.isfinite(seen.radius).all()


def test_a_wall_is_no_body(perceiver, frames):
    frame = frames[0]
    for depth in (0.4, 14.0):
        seen = perceiver.perceive(with_depth(depth)(frame), known(frame))
        assert np.isfinite(seen.radius).all()
        assert not np.isnan(seen.points).any()


def test_the_same_frame_gives_the_same_bytes(perceiver, frames):
    first, second = (perceiver.perceive(frames[3], known(frames[3])) for _ in range(2))
    for name in ("points", "radius", "expected_error", "variance"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()
