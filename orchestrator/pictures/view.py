"""Pictures of scenes as the agent's drone sees them: rendered, perceived and drawn."""

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.monitoring.live_display import Display
from orchestrator.pictures.scene_page import draw_scene_page
from orchestrator.pictures.worker_pair import worker_pair
from protocol.arrays import UInt8Array
from protocol.artifact import whole_file
from protocol.camera import Camera, CameraPose, Intrinsics, Vector3
from protocol.client.client import Client
from protocol.config import RunConfig
from protocol.config_file import load_config
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.messages import Perceive, Render, SampleScene
from protocol.pose_estimate import FilterState
from protocol.scene import MOST_BYSTANDERS, Scene, Split
from protocol.system.stop_request import StopRequest

SMALLEST_SIZE, LARGEST_SIZE = 16, 8192
"""What a camera can have, in pixels."""
LONGEST_STEP = 0.5
"""Metres that lie at most between a view and the one a step before."""

FARTHEST_VIEW = 1e3
"""Metres from the person, beyond which they are not visible."""

PICTURE_FORMATS = (".png", ".jpg", ".jpeg", ".webp")


class Viewpoint(Struct, frozen=True, kw_only=True):
    """The position of the camera, relative to the person.

    Attributes:
        distance: along the ground, metres.
        angle: degrees from the person's front, counter-clockwise seen from above: 90 is at their left.
        altitude: above the ground, metres.
    """

    distance: float = 3.0
    angle: float = 0.0
    altitude: float = 1.6

    def __post_init__(self) -> None:
        if not 0 < self.distance <= FARTHEST_VIEW:
            raise InvalidInput(
                f"a camera can't be {self.distance} m away from the person; say how far, above 0 and up to "
                f"{FARTHEST_VIEW:g}"
            )
        if not (math.isfinite(self.angle) and abs(self.altitude) <= FARTHEST_VIEW):
            raise InvalidInput(f"the camera's angle must be finite, and its altitude within ±{FARTHEST_VIEW:g} m")


class Look(Struct, frozen=True, kw_only=True):
    """The scenes to draw, their bystanders, and the viewpoint."""

    seeds: tuple[int, ...]
    split: Split = "test"
    viewpoint: Viewpoint = Viewpoint()
    bystanders: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.bystanders <= MOST_BYSTANDERS:
            raise InvalidInput(f"there can be 0 to {MOST_BYSTANDERS} bystanders, not {self.bystanders}")


def view_config(path: Path | None, size: str | None) -> RunConfig:
    """A configuration, or every setting's default, with pictures of `size`, as in `640x480`.

    Raises:
        InvalidConfig: the configuration is wrong.
        InvalidInput: the size is none.
    """
    config = load_config(path) if path else RunConfig()
    environment = config.environment
    if size is not None:
        width, height = parsed_size(size)
        environment = replace(environment, camera=replace(environment.camera, width=width, height=height))
    return replace(config, environment=environment)


def parsed_size(text: str) -> tuple[int, int]:
    """Width and height out of `640x480`.

    Raises:
        InvalidInput: it is no size, or none that a camera can have.
    """
    found = re.fullmatch(r"(\d+)x(\d+)", text)
    sizes = tuple(map(int, found.groups())) if found else ()
    if len(sizes) != 2 or not all(SMALLEST_SIZE <= size <= LARGEST_SIZE for size in sizes):
        raise InvalidInput(f"'{text}' is no size; write it as in 640x480, {SMALLEST_SIZE} to {LARGEST_SIZE} each way")
    return sizes


def picture_files(seeds: Sequence[int], output: Path | None) -> dict[int, Path]:
    """Where each scene's page goes: the file asked for, or `scene-SEED.png` in a directory.

    Raises:
        InvalidInput: one file was asked for and many scenes, or a file that is no picture.
    """
    if output is None or output.is_dir() or not output.suffix:
        return {seed: (output or Path()) / f"scene-{seed}.png" for seed in seeds}
    if len(seeds) > 1:
        raise InvalidInput(f"{len(seeds)} scenes don't go into one file {output}; give a directory")
    require_picture_format(output)
    return {seeds[0]: output}


def require_picture_format(path: Path) -> None:
    """Raise `InvalidInput` if a file's name says no format that we write."""
    if path.suffix.lower() not in PICTURE_FORMATS:
        raise InvalidInput(f"{path} has no ending of a picture; end it with one of {', '.join(PICTURE_FORMATS)}")


def camera_at(viewpoint: Viewpoint, scene: Scene, environment: EnvironmentConfig) -> Camera:
    """The drone's camera at a viewpoint, turned to the person as in a flight."""
    bearing = scene.yaw + math.radians(viewpoint.angle)
    x, y = scene.position
    position = (
        x + viewpoint.distance * math.cos(bearing),
        y + viewpoint.distance * math.sin(bearing),
        viewpoint.altitude,
    )
    return camera_from(position, scene, environment)


def camera_from(position: Vector3, scene: Scene, environment: EnvironmentConfig) -> Camera:
    """The drone's camera at a position in the world, turned to the person as in a flight."""
    x, y = scene.position
    optics = environment.camera
    return Camera(
        pose=CameraPose(position=position, target=(x, y, environment.target_height)),
        intrinsics=Intrinsics.from_horizontal_fov(optics.width, optics.height, optics.horizontal_fov),
        depth_noise=optics.depth_noise,
    )


def a_step_before(camera: Camera, environment: EnvironmentConfig, random: np.random.Generator) -> Camera:
    """Where a flying camera would have been a step before: at most `LONGEST_STEP` away, turned to the same target.

    It keeps the distance along the ground and the altitudes that a flight keeps, or the camera's own where that is
    nearer, lower or higher.
    """
    here, target = np.array(camera.pose.position), np.array(camera.pose.target)
    nearest = min(environment.keep_out_radius, float(np.hypot(*(here - target)[:2])))
    lowest, highest = min(environment.min_altitude, here[2]), max(environment.max_altitude, here[2])
    while True:
        direction = random.normal(size=3)
        step = LONGEST_STEP * random.random() ** (1 / 3) * direction / np.linalg.norm(direction)
        before = here + step
        if np.hypot(*(before - target)[:2]) >= nearest and lowest <= before[2] <= highest:
            x, y, z = before.tolist()
            return replace(camera, pose=replace(camera.pose, position=(x, y, z)))


def view(
    look: Look,
    config: RunConfig,
    *,
    show: Callable[[int, UInt8Array], None],
    display: Display,
    stop: StopRequest,
) -> None:
    """Have one render and one perception worker make the page of each scene.

    Args:
        show: given each seed and its page, (height, width, 3) RGB, as soon as it is drawn.

    Raises:
        ProcessFailed, DeadlineExceeded, Interrupted: as for a training.
        CallFailed: a worker could not answer.
    """
    with worker_pair(config, display=display, stop=stop) as pair:
        for seed in look.seeds:
            stop.check()
            show(seed, scene_page(pair.renderer, pair.perceiver, seed, look, config.environment))


def scene_page(
    renderer: Client, perceiver: Client, seed: int, look: Look, environment: EnvironmentConfig
) -> UInt8Array:
    """The page of one scene, drawn from what the workers answer."""
    viewpoint = look.viewpoint
    scene = renderer.call(SampleScene(seed=seed, split=look.split, bystanders=look.bystanders)).scene
    frame = renderer.call(Render(scene=scene, camera=camera_at(viewpoint, scene, environment), truth=True))
    filter_state = FilterState.initial((*scene.position, environment.target_height))
    observation = perceiver.call(Perceive(frame=frame, filter=filter_state, heatmaps=True))
    count = len(scene.bystanders)
    others = f", {count} bystander{'s' if count > 1 else ''}" if count else ""
    subtitle = (
        f"identity {scene.identity}, pose {scene.pose.kind}{others}; the camera {viewpoint.distance:g} m away, "
        f"{viewpoint.angle:g}° from the front, {viewpoint.altitude:g} m high"
    )
    return draw_scene_page(f"Scene {seed} ({look.split})", subtitle, frame, observation, scene.yaw)


def write_picture(path: Path, pixels: UInt8Array) -> None:
    """Write RGB pixels to a file, whole or not at all.

    Raises:
        InvalidInput: the file's name says no format that we write.
    """
    require_picture_format(path)
    written, encoded = cv2.imencode(path.suffix.lower(), cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR))
    if not written:
        raise InvalidInput(f"the picture {path} can't be encoded")
    with whole_file(path) as aside:
        aside.write_bytes(encoded.tobytes())
