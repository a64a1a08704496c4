"""The render worker's process: a renderer behind a socket."""

import argparse
import logging
from collections.abc import Sequence
from contextlib import ExitStack, closing
from pathlib import Path

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.config import RunConfig, load_config
from protocol.errors import VantageError
from protocol.logs import configure
from protocol.messages import Render, Role, Sampled, SampleScene
from protocol.server import Handlers, serve
from render_worker.renderer import Renderer, open_renderer
from render_worker.scenes import sample_scene

logger = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until told to stop; 2 when the worker can't start."""
    parser = argparse.ArgumentParser(prog="python -m render_worker", description="Draws scenes for whoever asks.")
    parser.add_argument(
        "--bind", required=True, help="address to serve at, such as ipc:///tmp/render or tcp://127.0.0.1:5601"
    )
    parser.add_argument("--config", type=Path, help="the run's configuration (default: every setting's default)")
    options = parser.parse_args(arguments)
    configure(Role.RENDER)
    try:
        run(load_config(options.config) if options.config else RunConfig(), options.bind)
    except VantageError as error:
        logger.error("%s", error)
        return 2
    return 0


def run(config: RunConfig, bind: str) -> None:
    """Open a renderer and serve it at `bind`.

    Raises:
        AddressUnavailable: the address can't be bound.
        Unavailable, ArtifactMissing, ArtifactDamaged: the renderer can't be opened.
    """
    with ExitStack() as held:

        def start() -> Handlers:
            renderer = held.enter_context(closing(open_renderer(config.render)))
            _warm_up(renderer)
            return {Render: renderer.render, SampleScene: answer_sample}

        serve(start, role=Role.RENDER, bind=bind, capabilities={"renderer": "opengl"})


def answer_sample(request: SampleScene) -> Sampled:
    """The scene of a seed and split."""
    return Sampled(scene=sample_scene(request.seed, request.split))


def _warm_up(renderer: Renderer) -> None:
    """Draw once, so that shaders are compiled before the first request waits for them."""
    view = CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0))
    camera = Camera(view, Intrinsics.from_horizontal_fov(64, 48, 70.0))
    renderer.render(Render(scene=sample_scene(0, "train"), camera=camera))
