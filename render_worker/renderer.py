"""The interface of renderers: `render(scene, camera) -> Frame`. Each renderer is one file."""

from typing import Protocol

from protocol.camera import Camera
from protocol.config import RenderConfig
from protocol.frame import Frame
from protocol.region import Region
from protocol.scene import Scene


class Renderer(Protocol):
    """Draws what a camera sees of a scene; the same arguments give the same bytes on the same machine."""

    def render(self, scene: Scene, camera: Camera, *, region: Region | None = None, truth: bool = False) -> Frame:
        """Draw one frame.

        Args:
            camera: its `depth_noise` decides how depth is measured.
            region: the part of the camera's picture to draw; all of it where there is none.
            truth: whether the frame carries the person's true joints, and which of them are visible.

        Raises:
            InvalidInput: the scene names an image that the renderer doesn't know.
        """
        ...

    def close(self) -> None:
        """Release what the renderer holds."""
        ...


def open_renderer(config: RenderConfig) -> Renderer:
    """Open the renderer that the configuration names.

    >>> from protocol.camera import Camera, CameraPose, Intrinsics
    >>> from protocol.config import RenderConfig
    >>> from render_worker import open_renderer, sample_scene
    >>> renderer = open_renderer(RenderConfig())
    >>> scene = sample_scene(seed=7, split="train")
    >>> lens = Intrinsics.from_horizontal_fov(640, 480, 70.0)
    >>> camera = Camera(CameraPose(position=(3.0, 0.0, 1.5), target=(0.0, 0.0, 1.0)), lens)
    >>> frame = renderer.render(scene, camera)
    >>> frame.rgb.shape, frame.depth.shape
    ((480, 640, 3), (480, 640))
    >>> renderer.close()

    Raises:
        Unavailable: this machine can't run it.
        ArtifactMissing, ArtifactDamaged: the file of bodies is missing or damaged.
    """
    from render_worker.assets import assets_path, load_assets
    from render_worker.opengl import OpenGlRenderer

    return OpenGlRenderer(load_assets(assets_path(config.bodies)), threads=config.threads)
