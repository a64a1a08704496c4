"""The process of a render worker: a renderer behind a socket."""

import argparse
import logging
import os
import time
from collections.abc import Sequence
from contextlib import ExitStack, closing
from pathlib import Path

from msgspec.structs import replace

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.config import RunConfig
from protocol.config_file import load_config, require_recorded_files
from protocol.errors import VantageError
from protocol.failpoint import Failpoint, failpoint_of, no_failpoint
from protocol.frame import Frame
from protocol.limits import require_picture_travels
from protocol.messages import Render, Role, Sampled, SampleScene
from protocol.packing.packing import pack
from protocol.region import Region
from protocol.security import LOCAL_ONLY, Security
from protocol.security.options import add_security_options, security_of
from protocol.server.registration_settings import ADVERTISE_HELP, RegistrationSettings, registration_of
from protocol.server.server import Handlers, serve
from protocol.system.exit_code import ExitCode, logged_exit_code_of
from protocol.system.logs import configure
from protocol.telemetry.endpoint import Endpoint, add_http_options, endpoint_of
from protocol.telemetry.info import About
from protocol.telemetry.worker import worker_telemetry
from protocol.timeouts import Timeouts
from render_worker.renderer import Renderer, open_renderer
from render_worker.scenes import sample_scene

logger = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until told to stop; returns the exit code."""
    options = _parser().parse_args(arguments)
    configure(Role.RENDER)
    try:
        run(
            _config(options),
            options.bind,
            registration=registration_of(options),
            failpoint=failpoint_of(os.environ),
            security=security_of(options, os.environ),
            http=endpoint_of(options, os.environ),
            name=options.name,
        )
    except (VantageError, OSError) as error:
        return logged_exit_code_of(error, logger)
    return ExitCode.DONE


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m render_worker", description="Draws scenes on request.")
    parser.add_argument(
        "--bind", required=True, help="address to serve at, such as ipc:///tmp/render or tcp://127.0.0.1:5601"
    )
    parser.add_argument("--config", type=Path, help="the run's configuration (default: every setting's default)")
    parser.add_argument("--orchestrator", metavar="ADDRESS", help="where to register (default: nowhere)")
    parser.add_argument("--name", default="render", help="this worker's name at the orchestrator (default: render)")
    parser.add_argument("--advertise", metavar="ADDRESS", help=ADVERTISE_HELP)
    add_security_options(parser)
    add_http_options(parser)
    return parser


def _config(options: argparse.Namespace) -> RunConfig:
    if options.config is None:
        return RunConfig()
    config = load_config(options.config)
    require_recorded_files(config, "render.")
    return config


def run(
    config: RunConfig,
    bind: str,
    *,
    registration: RegistrationSettings | None = None,
    failpoint: Failpoint = no_failpoint,
    security: Security = LOCAL_ONLY,
    http: Endpoint | None = None,
    name: str = "render",
) -> None:
    """Open a renderer and serve it at `bind`, and health and metrics at `http`.

    Raises:
        NotPermitted: other machines can reach `bind`, and there is no key.
        AddressUnavailable: an address can't be bound, or the orchestrator's is invalid.
        Unavailable, ArtifactMissing, ArtifactDamaged: the renderer can't be opened.
    """
    capabilities = {"renderer": "opengl"}
    about = About(role=Role.RENDER, name=name, serves=(bind,), capabilities=capabilities)
    with ExitStack() as held:
        observer = held.enter_context(worker_telemetry(http, about))

        def start() -> Handlers:
            renderer = held.enter_context(closing(open_renderer(config.render)))
            warm_up(renderer)
            return {Render: lambda request: draw(request, renderer), SampleScene: answer_sample}

        serve(
            start,
            role=Role.RENDER,
            bind=bind,
            capabilities=capabilities,
            concurrency=config.render.prefetch,
            timeouts=Timeouts.from_config(config.timeouts),
            registration=registration,
            failpoint=failpoint,
            security=security,
            observer=observer,
        )


def draw(request: Render, renderer: Renderer) -> Frame:
    """Answer `Render`: the frame, packed as requested.

    Raises:
        InvalidInput: as `Renderer.render`.
        LimitExceeded: the frame is too large to travel; nothing was drawn.
    """
    area = request.region or Region.seen_by(request.camera.intrinsics)
    require_picture_travels(area.width, area.height)
    frame = renderer.render(request.scene, request.camera, region=request.region, truth=request.truth)
    begun = time.perf_counter()
    packed = pack(frame, request.encoding)
    if packed is frame:
        return frame
    return replace(packed, timings={**frame.timings, "pack": time.perf_counter() - begun})


def answer_sample(request: SampleScene) -> Sampled:
    """Answer `SampleScene`: the scene of a seed and split.

    Raises:
        InvalidInput: as `sample_scene`.
    """
    return Sampled(scene=sample_scene(request.seed, request.split, request.bystanders, request.poses))


def warm_up(renderer: Renderer) -> None:
    """Draw once, so that the first request does not wait for shaders to compile."""
    view = CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0))
    camera = Camera(view, Intrinsics.from_horizontal_fov(64, 48, 70.0))
    renderer.render(sample_scene(0, "train"), camera)
