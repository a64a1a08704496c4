"""The perception worker: a perceiver behind a socket, with the render workers that it asks for frames."""

import logging
import os
import time
from collections.abc import Sequence

import cv2
import numpy as np
from msgspec.structs import replace

from perception_worker.calibration.choice import open_calibration
from perception_worker.detection import HeldPictures, Pictures
from perception_worker.detection.choice import open_detector
from perception_worker.frames import RenderedFrames, opened_by
from perception_worker.lifter import open_lifter
from perception_worker.lifting import LIFTINGS
from perception_worker.networks.backend import input_size, network_name, region_size
from perception_worker.options import config_of, options_of
from perception_worker.perceive import Perceiver
from perception_worker.stopwatch import Clock
from protocol import Handlers, Pool, Timeouts, serve
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.config import FrameEncoding, PerceptionConfig, RunConfig, settled
from protocol.errors import InvalidConfig, VantageError
from protocol.failpoint import Failpoint, failpoint_of, no_failpoint
from protocol.frame import ENCODINGS, Frame
from protocol.messages import Observe, Perceive, Role
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.security import LOCAL_ONLY, Security
from protocol.security.options import security_of
from protocol.server.registration_settings import RegistrationSettings, registration_of
from protocol.system import logs
from protocol.system.exit_code import ExitCode, logged_exit_code_of
from protocol.telemetry.endpoint import Endpoint, endpoint_of
from protocol.telemetry.info import About
from protocol.telemetry.worker import worker_telemetry

_logger = logging.getLogger(__name__)

_RENDER_SHARE = 0.75
"""Share of a call's time that rendering may take, so that the answer names a lost render worker in time.

It is a share of the progress clock's time as well: a stuck renderer must not make this worker look stuck.
"""


class PerceptionHandlers:
    """Answers `Perceive` from the request's own frame, and `Observe` from a frame that it has rendered."""

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
            CallFailed: no render worker gave a frame; another try may succeed.
            MalformedMessage, LimitExceeded: the frame can't be opened.
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
        """The handler of each request."""
        return {Perceive: self.perceive, Observe: self.observe}


def run(
    config: RunConfig,
    *,
    bind: str,
    render: Sequence[str],
    registration: RegistrationSettings | None = None,
    failpoint: Failpoint = no_failpoint,
    security: Security = LOCAL_ONLY,
    http: Endpoint | None = None,
    name: str = "perception",
) -> None:
    """Serve at `bind` until told to end, with frames from the render workers that `render` and the orchestrator name.

    Health and metrics are served at `http`.

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
        serve(
            lambda: _start(perception, renderers, render_deadline(timeouts)),
            role=Role.PERCEPTION,
            bind=bind,
            capabilities=capabilities,
            concurrency=perception.prefetch,
            timeouts=timeouts,
            registration=registration and registration._replace(follows={Role.RENDER: renderers}),
            failpoint=failpoint,
            security=security,
            observer=observer,
            calls={Role.RENDER: renderers},
        )


def _start(config: PerceptionConfig, renderers: Pool, deadline: float) -> Handlers:
    """Handlers that are ready to answer: the network is warm, and a render worker is there."""
    # The frames in hand are the parallel work; OpenCV's own threads would only contend for the same cores.
    cv2.setNumThreads(1)
    perceiver = open_perceiver(config)
    warm_up(perceiver)
    renderers.wait_any_ready()
    return PerceptionHandlers(perceiver, renderers, render_deadline=deadline, frames=config.frames).table()


def open_perceiver(config: PerceptionConfig) -> Perceiver:
    """The pipeline with the network and the calibration that a configuration, settled by its profile, names.

    Raises:
        InvalidConfig: a calibration or a lifter is named that the way of lifting does not use.
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
    """Perceive a black picture, so that the first request does not wait for what a network does only once.

    The filter expects a person in it, so that a tracking detector runs on a region and then on the whole frame.
    """
    camera = Camera(CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(640, 480, 70.0))
    black = Frame(rgb=np.zeros((480, 640, 3), np.uint8), depth=np.zeros((480, 640), np.float32), camera=camera)
    initial = FilterState.initial((0.0, 0.0, 1.0))
    perceiver.perceive(black, replace(initial, variance=np.zeros((18, 3)), seen=np.ones(18, bool)))


def render_deadline(timeouts: Timeouts) -> float:
    """Seconds that rendering a frame may take, with retries on other workers included."""
    return _RENDER_SHARE * min(timeouts.call, timeouts.progress)


def _capabilities(config: PerceptionConfig) -> dict[str, str]:
    """What the worker's `Welcome` tells a client."""
    size, region = input_size(config), region_size(config)
    return {
        "network": network_name(config),
        "input": f"{size[0]}x{size[1]}" if size else "the file's",
        "precision": config.precision,
        "look": config.look,
        "region": f"{region[0]}x{region[1]}" if config.look == "track" and region else "",
        "lifting": config.lifting,
        "mask": config.mask,
        # The readings that a client may ask for.
        "liftings": " ".join(LIFTINGS),
        # The encodings that a client may send in `Perceive`: an older worker does not know packed frames.
        "frames": " ".join(ENCODINGS),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """`python -m perception_worker`; returns the exit code."""
    chosen = options_of(arguments)
    logs.configure(Role.PERCEPTION)
    try:
        run(
            config_of(chosen),
            bind=chosen.bind,
            render=chosen.render,
            registration=registration_of(chosen),
            failpoint=failpoint_of(os.environ),
            security=security_of(chosen, os.environ),
            http=endpoint_of(chosen, os.environ),
            name=chosen.name,
        )
    except (VantageError, OSError) as error:
        return logged_exit_code_of(error, _logger)
    return ExitCode.DONE
