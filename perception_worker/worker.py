"""The perception worker: a perceiver behind a socket, with the render workers that it asks for frames."""

import argparse
import logging
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import cv2
import numpy as np
from msgspec.structs import replace

from perception_worker.calibration.choice import open_calibration
from perception_worker.detection import HeldPictures, Pictures
from perception_worker.frames import RenderedFrames, opened_by
from perception_worker.lifter import open_lifter
from perception_worker.lifting import LIFTINGS
from perception_worker.networks.backend import input_size, network_name, open_detector, region_size
from perception_worker.perceive import Perceiver
from perception_worker.stopwatch import Clock
from protocol import Handlers, Pool, Timeouts, serve
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.config import FrameEncoding, PerceptionConfig, RunConfig, settled
from protocol.config_file import load_config, require_recorded_files
from protocol.errors import InvalidConfig, VantageError
from protocol.failpoint import Failpoint, failpoint_of, no_failpoint
from protocol.frame import ENCODINGS, Frame
from protocol.messages import Observe, Perceive, Role
from protocol.named_files import with_absolute_paths
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.security import LOCAL_ONLY, Security
from protocol.security.options import add_security_options, security_of
from protocol.server.worker_registration import ADVERTISE_HELP, WorkerRegistration, registration_of
from protocol.system import logs
from protocol.system.exit_code import ExitCode, logged_exit_code_of
from protocol.telemetry.endpoint import Endpoint, add_http_options, endpoint_of
from protocol.telemetry.info import About
from protocol.telemetry.worker import worker_telemetry

_logger = logging.getLogger(__name__)

_SECTION = "perception."
"""Of the configuration: ours."""

_RENDER_SHARE = 0.75
"""Share of a call's time that rendering may take: then a lost render worker is named in our answer, in time.

It is a share of the progress clock's time as well, so that nobody takes us for stuck while a renderer is.
"""


class PerceptionHandlers:
    """Answers `Perceive` from the frame that it brings, and `Observe` from one that is rendered for it."""

    def __init__(
        self,
        perceiver: Perceiver,
        renderers: Pool,
        *,
        render_deadline: float,
        frames: FrameEncoding = "auto",
        clock: Clock = time.perf_counter,
    ) -> None:
        self._perceiver = perceiver
        self._clock = clock
        self._frames = RenderedFrames(renderers, deadline=render_deadline, encoding=frames, clock=clock)

    def perceive(self, request: Perceive) -> PoseEstimate:
        """Estimate the pose in a frame at hand.

        Raises:
            MalformedMessage, LimitExceeded: the frame is packed and can't be opened.
        """
        return self._estimate(HeldPictures(opened_by(self._clock, request.frame)), request)

    def observe(self, request: Observe) -> PoseEstimate:
        """Have a scene rendered and estimate the pose in it.

        Raises:
            CallFailed: no render worker gave a frame; another try may.
            MalformedMessage, LimitExceeded: the frame that one gave can't be opened.
        """
        return self._estimate(self._frames.of(request), request)

    def _estimate(self, pictures: Pictures, request: Perceive | Observe) -> PoseEstimate:
        return self._perceiver.observe(
            pictures,
            request.filter,
            heatmaps=request.heatmaps,
            liftings=request.liftings,
            evidence=request.evidence,
        )

    def table(self) -> Handlers:
        """Which function answers which request."""
        return {Perceive: self.perceive, Observe: self.observe}


def run(
    config: RunConfig,
    *,
    bind: str,
    render: Sequence[str],
    membership: WorkerRegistration | None = None,
    failpoint: Failpoint = no_failpoint,
    security: Security = LOCAL_ONLY,
    http: Endpoint | None = None,
    name: str = "perception",
) -> None:
    """Serve at `bind` until told to end, with frames from the render workers that `render` and the orchestrator name.

    How the worker is, is served at `http`.

    Raises:
        VantageError: the network can't be loaded, no render worker gets ready, an address can't be bound, or other
            machines can reach it and there is no key.
    """
    timeouts = Timeouts.from_config(config.timeouts)
    perception = with_lifter_at_hand(settled(config.perception, config.profile))
    capabilities = _capabilities(perception)
    about = About(role=Role.PERCEPTION, name=name, serves=(bind,), capabilities=capabilities)
    with (
        Pool(render, role=Role.PERCEPTION, serves=Role.RENDER, timeouts=timeouts, security=security) as renderers,
        worker_telemetry(http, about, {Role.RENDER: renderers}) as observer,
    ):

        def start() -> Handlers:
            # The frames in hand are the parallel work; OpenCV's own threads would only contend for the same cores.
            cv2.setNumThreads(1)
            perceiver = open_perceiver(perception)
            warm_up(perceiver)
            renderers.wait_any_ready()
            deadline = render_deadline(timeouts)
            return PerceptionHandlers(perceiver, renderers, render_deadline=deadline, frames=perception.frames).table()

        serve(
            start,
            role=Role.PERCEPTION,
            bind=bind,
            capabilities=capabilities,
            concurrency=perception.prefetch,
            timeouts=timeouts,
            membership=membership and membership._replace(follows={Role.RENDER: renderers}),
            failpoint=failpoint,
            security=security,
            observer=observer,
            calls={Role.RENDER: renderers},
        )


def open_perceiver(config: PerceptionConfig) -> Perceiver:
    """The pipeline with the network and the calibration that a configuration, settled by its profile, names.

    Raises:
        InvalidConfig: a calibration or a lifter is named, and the way of lifting has no use for it.
        VantageError: one of them can't be loaded.
    """
    if config.lifting == "learned":
        if config.calibration not in ("auto", "none"):
            raise InvalidConfig(
                f"perception.calibration: {config.calibration} tells the errors of surfaces that are lifted, and this "
                f"worker's lifter tells its own; choose another perception.lifting, or calibration auto"
            )
        return Perceiver(open_detector(config), config, lifter=open_lifter(config))
    if config.lifter != "auto":
        raise InvalidConfig(
            f"perception.lifter: {config.lifter} is named, and this worker lifts by {config.lifting}; "
            f"choose perception.lifting learned, or lifter auto"
        )
    calibration = open_calibration(config)
    if calibration is None and config.calibration == "auto":
        name = network_name(config)
        _logger.info("no calibration is shipped for %s with these settings: quality comes without metres", name)
    return Perceiver(open_detector(config), config, calibration=calibration)


def with_lifter_at_hand(config: PerceptionConfig) -> PerceptionConfig:
    """The configuration, settled by its profile, with a lifting that there is: `nearest` where no lifter is shipped.

    Raises:
        InvalidConfig, ArtifactDamaged: as `open_lifter`.
    """
    if config.lifting != "learned" or open_lifter(config) is not None:
        return config
    _logger.info("no lifter is shipped for %s with these settings: surfaces are lifted", network_name(config))
    return replace(config, lifting="nearest")


def warm_up(perceiver: Perceiver) -> None:
    """Look at a black picture, so that what a network does but once is done before the first request waits for it.

    Somebody is expected in it, so that whoever tracks is shown a region and, in vain, the whole frame.
    """
    camera = Camera(CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(640, 480, 70.0))
    black = Frame(rgb=np.zeros((480, 640, 3), np.uint8), depth=np.zeros((480, 640), np.float32), camera=camera)
    somebody = replace(FilterState.initial((0.0, 0.0, 1.0)), variance=np.zeros((18, 3)), seen=np.ones(18, bool))
    perceiver.perceive(black, somebody)


def render_deadline(timeouts: Timeouts) -> float:
    """Seconds that a frame may take to be rendered, lost workers and all."""
    return _RENDER_SHARE * min(timeouts.call, timeouts.progress)


def _capabilities(config: PerceptionConfig) -> dict[str, str]:
    """What a client is told of the worker when it says hello."""
    size, region = input_size(config), region_size(config)
    return {
        "network": network_name(config),
        "input": f"{size[0]}x{size[1]}" if size else "the file's",
        "precision": config.precision,
        "look": config.look,
        "region": f"{region[0]}x{region[1]}" if config.look == "track" and region else "",
        "lifting": config.lifting,
        "mask": config.mask,
        # What a client may ask to be read along.
        "liftings": " ".join(LIFTINGS),
        # What a client may send in `Perceive`: an older worker does not know packed frames.
        "frames": " ".join(ENCODINGS),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """`python -m perception_worker`; returns the exit code."""
    parser = _parser()
    chosen = parser.parse_args(arguments)
    if not chosen.render and not chosen.orchestrator:
        parser.error("who draws the frames? Give --render, or --orchestrator to be told")
    logs.configure(Role.PERCEPTION)
    try:
        run(
            _config(chosen),
            bind=chosen.bind,
            render=chosen.render,
            membership=registration_of(chosen),
            failpoint=failpoint_of(os.environ),
            security=security_of(chosen, os.environ),
            http=endpoint_of(chosen, os.environ),
            name=chosen.name,
        )
    except (VantageError, OSError) as error:
        return logged_exit_code_of(error, _logger)
    return ExitCode.DONE


def _config(chosen: argparse.Namespace) -> RunConfig:
    """The run's configuration, with what the command line says instead."""
    config = RunConfig() if chosen.config is None else load_config(chosen.config)
    instead = {"network": chosen.network, "calibration": chosen.calibration, "frames": chosen.frames}
    given = {name: value for name, value in instead.items() if value is not None}
    instead_of = {f"{_SECTION}{name}" for name in given}
    told = replace(
        config,
        perception=replace(config.perception, **given),
        artifacts={name: checksum for name, checksum in config.artifacts.items() if name not in instead_of},
    )
    require_recorded_files(told, _SECTION)
    # What the command line says is relative to where we were called; the file's paths are absolute by now.
    return with_absolute_paths(told, Path.cwd())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="perception_worker", description="Estimates a person's 3D pose in frames, and how sure it is."
    )
    parser.add_argument("--bind", required=True, metavar="ADDRESS", help="where to serve, such as tcp://127.0.0.1:5556")
    parser.add_argument(
        "--render",
        action="append",
        default=[],
        metavar="ADDRESS",
        help="a render worker; may be given repeatedly, and need not be where there is an orchestrator",
    )
    parser.add_argument(
        "--orchestrator", metavar="ADDRESS", help="whom to register with, and to learn of renderers from"
    )
    parser.add_argument(
        "--name", default="perception", help="what the orchestrator calls this worker (default: perception)"
    )
    parser.add_argument("--advertise", metavar="ADDRESS", help=ADVERTISE_HELP)
    add_security_options(parser)
    parser.add_argument("--config", type=Path, metavar="FILE", help="the run's configuration; the defaults without it")
    parser.add_argument(
        "--network", metavar="NAME|FILE", help="a name or an ONNX file, in place of the configuration's"
    )
    parser.add_argument(
        "--calibration",
        metavar="FILE|auto|none",
        help="what tells errors in metres, in place of the configuration's: a file of 'orchestrator calibration fit', "
        "the shipped one that fits (auto), or nothing; a learned lifter tells its own",
    )
    parser.add_argument(
        "--frames",
        choices=get_args(FrameEncoding),
        help="how frames come from render workers, in place of the configuration's: as they are (none), packed without "
        "loss, as a JPEG, or lossless from other machines and none within this one (auto)",
    )
    add_http_options(parser)
    return parser
