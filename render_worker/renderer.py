"""What draws scenes. Each renderer is one file; they all have this one method."""

from typing import Protocol

from protocol.config import RenderConfig
from protocol.frame import Frame
from protocol.messages import Render


class Renderer(Protocol):
    """Draws what a camera sees of a scene; the same request gives the same bytes on the same machine."""

    def render(self, request: Render) -> Frame:
        """Draw one frame.

        Raises:
            InvalidInput: the scene names an image that the renderer doesn't know.
        """
        ...

    def close(self) -> None:
        """Give back what the renderer holds."""
        ...


def open_renderer(config: RenderConfig) -> Renderer:
    """Make the renderer that the configuration asks for.

    Raises:
        Unavailable: this machine can't run it.
        ArtifactMissing, ArtifactDamaged: the file of bodies is not there, or not whole.
    """
    from render_worker.assets import assets_path, load_assets
    from render_worker.opengl import OpenGlRenderer

    return OpenGlRenderer(load_assets(assets_path(config.bodies)), threads=config.threads)
