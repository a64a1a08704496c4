"""Numbers that no scene, camera, filter or machine has, sent to a worker as it serves or written into a configuration.

The types are held to it by tests/protocol/test_quantities.py, whole workers by protocol/compliance/test_numbers.py.
"""

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import zmq
from typer.testing import CliRunner

from orchestrator.cli.app import app
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.compliance.numbers import numbers_of, with_number
from protocol.compliance.wire import Wire, connected, parts_of
from protocol.frame import Frame
from protocol.message import Request
from protocol.messages import Failure, Perceive, Render
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.region import Region
from protocol.scene import Scene
from render_worker.worker import draw
from tests.protocol.processes.serving import serving
from tests.protocol.values.samples import SCENE

CAMERA = Camera(CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(32, 24, 70.0))
RENDER = Render(scene=SCENE, camera=CAMERA)
PERCEIVE = Perceive(
    frame=Frame(rgb=np.zeros((24, 32, 3), np.uint8), depth=np.ones((24, 32), np.float32), camera=CAMERA),
    filter=FilterState.initial(),
)


class NeverAsked:
    """A renderer and a perceiver that computes nothing, and tells whether it was asked to."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def render(self, scene: Scene, camera: Camera, *, region: Region | None = None, truth: bool = False) -> Frame:
        self.asked.append("render")
        return PERCEIVE.frame

    def perceive(self, request: Perceive) -> PoseEstimate:
        self.asked.append("perceive")
        nothing, nowhere = np.zeros(18), np.full((18, 3), np.nan)
        return PoseEstimate(
            keypoints=nowhere[:, :2],
            points=nowhere,
            mass=nothing,
            height=nothing,
            distance=nothing,
            quality=nothing,
            filter=request.filter,
        )

    def close(self) -> None:
        pass


@pytest.fixture
def room() -> NeverAsked:
    return NeverAsked()


@pytest.fixture
def wire(room: NeverAsked) -> Iterator[Wire]:
    """To a worker that serves the room's functions."""
    handlers = {Render: lambda request: draw(request, room), Perceive: room.perceive}
    with tempfile.TemporaryDirectory(prefix="v") as folder, zmq.Context() as context:
        address = f"ipc://{folder}/worker"
        with serving(address, handlers), connected(context, address, 30.0) as wire:
            yield wire


def told(wire: Wire, request: Request, field: str, value: float) -> object:
    """What is answered where the first number of a field is another."""
    number = wire.next_number()
    parts = parts_of(request, number)
    (place, *_) = [one for one in numbers_of(parts) if one.words.startswith(field)]
    wire.send(with_number(parts, place, value))
    return wire.answer(number).message


@pytest.mark.parametrize(
    ("request_", "field", "value"),
    [
        (RENDER, "scene.pose.left_arm.wrist", 1e300),
        (RENDER, "scene.bystanders.0.pose.right_arm.wrist", 1e300),
        (RENDER, "scene.sun.azimuth", math.inf),
        (RENDER, "scene.sun.elevation", math.inf),
        (RENDER, "scene.sun.elevation", -1.0),
        (RENDER, "scene.sun.strength", -math.inf),
        (RENDER, "scene.sun.strength", -1.0),
        (RENDER, "scene.position", math.nan),
        (RENDER, "scene.yaw", 1e300),
        (RENDER, "scene.pose.head.turn", math.nan),
        (RENDER, "scene.appearance", -1.0),
        (RENDER, "camera.intrinsics.fx", math.nan),
        (RENDER, "camera.pose.position", 1e300),
        (PERCEIVE, "filter.mean", math.nan),
        (PERCEIVE, "filter.variance", math.nan),
        (PERCEIVE, "filter.variance", -1.0),
        (PERCEIVE, "filter.variance", math.inf),
        (PERCEIVE, "filter.process_noise", -1.0),
        (PERCEIVE, "frame.camera.intrinsics.cx", math.inf),
    ],
)
def test_what_no_scene_has_is_refused_by_name_before_anything_is_computed(wire, room, request_, field, value):
    reply = told(wire, request_, field, value)
    assert isinstance(reply, Failure)
    assert (reply.code, reply.retryable) == ("invalid-input", False)
    assert field.rpartition(".")[2] in reply.message
    assert room.asked == []


def test_a_picture_that_can_t_travel_is_refused_before_it_is_drawn(wire, room):
    intrinsics = Intrinsics.from_horizontal_fov(8192, 8192, 70.0)
    reply = wire.call(Render(scene=SCENE, camera=Camera(CAMERA.pose, intrinsics)))
    assert isinstance(reply, Failure)
    assert reply.code == "limit-exceeded"
    assert room.asked == []


@pytest.mark.parametrize("deadline", [math.nan, math.inf, -math.inf, 1e300, -1.0])
def test_a_deadline_that_is_none_is_told_and_not_waited_out(wire, room, deadline):
    number = wire.next_number()
    wire.send(parts_of(RENDER, number, deadline=deadline))
    reply = wire.answer(number).message
    assert isinstance(reply, Failure)
    assert reply.code == "malformed-message"
    assert "deadline" in reply.message
    assert room.asked == []


def test_what_is_odd_and_possible_is_answered(wire, room):
    assert isinstance(told(wire, RENDER, "scene.yaw", -1.0), Frame)
    assert isinstance(told(wire, PERCEIVE, "frame.depth", math.nan), PoseEstimate)
    assert room.asked == ["render", "perceive"]


CONFIGURATIONS = [
    ("[evaluation]\nfirst_seed = -1\n", "evaluation.first_seed"),
    ("[environment]\nhalf_width = inf\n", "environment.half_width"),
    ("[environment.camera]\nwidth = 8192\nheight = 8192\n", "environment.camera.width"),
    ("[timeouts]\ncall = inf\n", "timeouts.call"),
    ("[timeouts]\ncall = 1e300\n", "timeouts.call"),
    ("[environment]\npenalty = nan\n", "environment.penalty"),
    ("[environment]\nkeep_out_radius = 8.9\n", "environment.keep_out_radius"),
    ("[learner.sac]\nbuffer_size = 100\n", "learner.sac.buffer_size"),
    ("[learner.sac]\nbuffer_size = 100_000_000_000\n", "learner.sac.buffer_size"),
    ("[learner.sac]\nlearning_rate = nan\n", "learner.sac.learning_rate"),
    ("[learner.sac]\nhidden_sizes = [1_000_000_000]\n", "learner.sac.hidden_sizes"),
    ('[learner]\nalgorithm = "ppo"\nppo = {n_steps = 1, minibatches = 5}\n', "learner.ppo.n_steps"),
    ("[render]\nworkers = 1_000_000\n", "render.workers"),
    ("[supervision]\nwindow = inf\n", "supervision.window"),
    ('[perception]\nbackend = "onnxruntime"\nprecision = "bf16"\n', "perception.precision"),
]


@pytest.mark.parametrize(("text", "field"), CONFIGURATIONS, ids=[f"{field}" for _, field in CONFIGURATIONS])
def test_a_configuration_that_can_t_work_ends_with_code_2_and_makes_nothing(tmp_path, monkeypatch, text, field):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "odd.toml").write_text(text)
    done = CliRunner().invoke(app, ["train", "odd.toml", "--run", "runs/odd"])
    assert done.exit_code == 2
    assert field in done.stderr
    assert [path.name for path in Path(tmp_path).iterdir()] == ["odd.toml"]
