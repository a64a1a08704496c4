"""What the room's tests share: the baked bodies, a renderer, and cameras that look at a scene's person."""

import math
from collections.abc import Callable, Iterator

import pytest

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.config import RenderConfig
from protocol.scene import Scene
from render_worker.assets import Assets, assets_path, load_assets
from render_worker.renderer import Renderer, open_renderer


@pytest.fixture(scope="session")
def assets() -> Assets:
    return load_assets(assets_path())


@pytest.fixture(scope="session")
def renderer() -> Iterator[Renderer]:
    opened = open_renderer(RenderConfig())
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def look_at() -> Callable[..., Camera]:
    """A camera at some degrees from the person's front, 90 at their left, and some metres away."""

    def camera(
        scene: Scene, degrees: float, distance: float, *, size: tuple[int, int] = (640, 480), altitude: float = 1.5
    ) -> Camera:
        azimuth = scene.yaw + math.radians(degrees)
        x, y = scene.position
        eye = (x + distance * math.cos(azimuth), y + distance * math.sin(azimuth), altitude)
        return Camera(CameraPose(eye, (x, y, 1.0)), Intrinsics.from_horizontal_fov(*size, 70.0))

    return camera
