"""The views that a lifter learns from: the person, their pose, the camera, and the filter's state before the view.

A view depends only on the set's seed and its own number.
"""

import math

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.pictures.view import Viewpoint, camera_at
from protocol.arrays import Float64Array
from protocol.camera import Camera, DepthNoise, Intrinsics, Vector3
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.messages import SampleScene
from protocol.pose_estimate import FilterState
from protocol.scene import TRAIN_IDENTITIES, Poses, Scene
from protocol.skeleton import JOINT_COUNT

DISTANCE, ALTITUDE, FIELD_OF_VIEW = (1.0, 10.0), (0.6, 2.8), (50.0, 90.0)
"""Drawn evenly: metres along the ground, metres above it, degrees."""

SIZES = ((640, 480), (640, 480), (848, 480), (424, 240), (1280, 720))
NOISES: tuple[DepthNoise, ...] = ("none", "d435i")

ACCOMPANIED, HIDDEN, TURNED_ASIDE, UNKNOWN = 0.15, 0.08, 0.3, 0.1
"""Shares of the scenes with a bystander, and of the views with an obstacle before the person, with a camera that is not
turned to the person's middle, and with an initial filter."""

ASIDE: Vector3 = (0.35, 0.35, 0.4)
"""Metres, standard deviations of the target of a camera that is not turned to the person's middle."""

BODY_OFF, JOINT_OFF = (0.01, 0.25), (0.02, 0.15)
"""Metres, standard deviations of a filter's body and of each of its joints, log-uniform."""

IN_FRONT = (0.3, 0.8)
"""Where a bystander in front stands, as a share of the way from the person to the camera."""


class FitViews(Struct, frozen=True, kw_only=True):
    """All the views that a lifter is fitted on.

    Attributes:
        wide: the share of scenes with poses of the widest ranges; the others have the eight kinds.
        views_a_scene: views in a row of one scene, except for its bystanders.
        frames_a_part: how many are written at once; a kill loses at most these.
    """

    frames: int = 60000
    seed: int = 0
    wide: float = 0.65
    views_a_scene: int = 4
    frames_a_part: int = 400

    def __post_init__(self) -> None:
        if min(self.frames, self.views_a_scene, self.frames_a_part) < 1 or self.seed < 0 or not 0 <= self.wide <= 1:
            raise InvalidInput("a lifter is fitted on a frame or more, with a seed of 0 or more and a share of 0 to 1")
        if self.frames_a_part % self.views_a_scene:
            raise InvalidInput("a part has whole scenes")

    @property
    def words(self) -> str:
        """A description of the views, for messages."""
        each = f"{self.views_a_scene} a scene, {self.frames_a_part} a part"
        return f"{self.frames} frames, seed {self.seed}, {each}, {self.wide:g} of the scenes in wide poses"


class FitView(Struct, frozen=True, kw_only=True):
    """One view.

    Attributes:
        viewpoint: the camera's, relative to the person.
        aside: metres in the world by which its target is beside the person's middle.
        off: metres, standard deviations of the filter's body and of each joint; None for an initial filter.
        hidden: whether an obstacle is before the person.
    """

    number: int
    viewpoint: Viewpoint
    intrinsics: Intrinsics
    depth_noise: DepthNoise
    aside: Vector3
    off: tuple[float, float] | None
    hidden: bool


def scene_request(views: FitViews, scene: int) -> SampleScene:
    """The request for scene number `scene`; its identity is to be replaced by `identity_of`."""
    random = np.random.default_rng((views.seed, scene, 0))
    poses: Poses = "wide" if random.random() < views.wide else "kinds"
    return SampleScene(
        seed=int(random.integers(2**31)), split="train", bystanders=int(random.random() < ACCOMPANIED), poses=poses
    )


def identity_of(scene: int) -> int:
    """The identity of a scene: all in turn."""
    return TRAIN_IDENTITIES[scene % len(TRAIN_IDENTITIES)]


def fit_view(views: FitViews, number: int) -> FitView:
    """View `number`."""
    random = np.random.default_rng((views.seed, number, 1))
    distance, altitude, degrees = (float(random.uniform(*bounds)) for bounds in (DISTANCE, ALTITUDE, FIELD_OF_VIEW))
    turned = random.random() < TURNED_ASIDE
    aside = random.normal(0.0, ASIDE) * turned
    body, joint = (math.exp(random.uniform(*np.log(bounds))) for bounds in (BODY_OFF, JOINT_OFF))
    return FitView(
        number=number,
        viewpoint=Viewpoint(distance=distance, angle=float(random.uniform(-180, 180)), altitude=altitude),
        intrinsics=Intrinsics.from_horizontal_fov(*SIZES[random.integers(len(SIZES))], degrees),
        depth_noise=NOISES[random.integers(len(NOISES))],
        aside=(float(aside[0]), float(aside[1]), float(aside[2])),
        off=None if random.random() < UNKNOWN else (body, joint),
        hidden=bool(random.random() < HIDDEN),
    )


def camera_of(view: FitView, scene: Scene, environment: EnvironmentConfig) -> Camera:
    """The camera of a view."""
    camera = camera_at(view.viewpoint, scene, environment)
    target = np.add(camera.pose.target, view.aside).tolist()
    pose = replace(camera.pose, target=(target[0], target[1], target[2]))
    return Camera(pose=pose, intrinsics=view.intrinsics, depth_noise=view.depth_noise)


def believed(views: FitViews, view: FitView, joints: Float64Array, scene: Scene, height: float) -> FilterState:
    """The filter's state before a view.

    Args:
        joints: (18, 3) the true ones, world frame, metres.
        height: metres above the ground at which an initial filter begins.
    """
    begun = FilterState.initial((*scene.position, height))
    if view.off is None:
        return begun
    random = np.random.default_rng((views.seed, view.number, 2))
    body, joint = view.off
    mean = joints + random.normal(0.0, body, 3) + random.normal(0.0, joint, (JOINT_COUNT, 3))
    variance = np.full((JOINT_COUNT, 3), body**2 + joint**2)
    return replace(begun, mean=mean, variance=variance, seen=np.ones(JOINT_COUNT, bool))


def company_of(views: FitViews, view: FitView, scene: Scene, camera: Camera) -> Scene:
    """The scene with its bystander, in half of the views moved between the person and the camera."""
    random = np.random.default_rng((views.seed, view.number, 3))
    if not scene.bystanders or random.random() < 0.5:
        return scene
    person, eye = np.array(scene.position), np.array(camera.pose.position[:2])
    x, y = person + random.uniform(*IN_FRONT) * (eye - person) + random.normal(0.0, 0.25, 2)
    return replace(scene, bystanders=(replace(scene.bystanders[0], position=(float(x), float(y))),))
