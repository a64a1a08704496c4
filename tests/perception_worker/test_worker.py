import json
import signal
import threading
from contextlib import contextmanager

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.detection import WholeFrameDetector
from perception_worker.perceive import Perceiver
from perception_worker.worker import PerceptionHandlers, main, render_deadline
from protocol import Client, Pool, Timeouts
from protocol.config import PerceptionConfig
from protocol.errors import DeadlineExceeded, InvalidInput, Rejected
from protocol.frame import Frame
from protocol.messages import Observe, Perceive, Render, Role, State
from protocol.packing.packing import pack
from protocol.pose_estimate import FilterState
from protocol.skeleton import Joint
from protocol.system.exit_code import ExitCode
from tests.perception_worker.calibration.trees import SETTING, stored
from tests.perception_worker.drawn_maps import DrawnNetwork, person
from tests.perception_worker.workers import CAMERA, PATIENCE, SCENE, running
from tests.protocol.processes.registry import Registry, record
from tests.protocol.processes.waiting import wait_until
from tests.protocol.telemetry.monitors import free_endpoint, monitoring
from tests.serving import serving

OBSERVE = Observe(scene=SCENE, camera=CAMERA, filter=FilterState.initial())
SOMEBODY = DrawnNetwork(person(20, 14))


def render(request):
    """A black picture, three metres away; the true joints, where asked for, are at the origin."""
    return Frame(
        rgb=np.zeros((480, 640, 3), np.uint8),
        depth=np.full((480, 640), 3.0, np.float32),
        camera=request.camera,
        joints=np.zeros((18, 3)) if request.truth else None,
        visible=np.ones(18, bool) if request.truth else None,
        timings={"render": 0.125},
    )


@pytest.fixture
def addresses(tmp_path):
    return f"ipc://{tmp_path}/render", f"ipc://{tmp_path}/perception"


@contextmanager
def perceiving(addresses, network, *, concurrency=1, render_deadline=20.0):
    """A client of perception handlers that ask the first address for frames and serve at the second."""
    render_address, address = addresses
    perceiver = Perceiver(WholeFrameDetector(network), PerceptionConfig())
    with Pool([render_address], role=Role.PERCEPTION, serves=Role.RENDER) as renderers:
        handlers = PerceptionHandlers(perceiver, renderers, render_deadline=render_deadline).table()
        with (
            serving(handlers, address, role=Role.PERCEPTION, concurrency=concurrency),
            Client(address, role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as client,
        ):
            yield client


class TestObserve:
    @pytest.fixture
    def client(self, addresses):
        with (
            serving({Render: render}, addresses[0], role=Role.RENDER),
            perceiving(addresses, SOMEBODY) as client,
        ):
            yield client

    def test_perceives_the_frame_that_was_rendered_for_it(self, client):
        estimate = client.call(OBSERVE)
        assert estimate.keypoints == pytest.approx((person(20, 14) + 0.5) * 16 - 0.5, abs=3)
        assert estimate.filter.seen.all()
        assert estimate.heatmaps is None
        assert estimate.joints is None

    def test_passes_the_truth_on_when_it_is_asked_for(self, client):
        estimate = client.call(
            Observe(scene=SCENE, camera=CAMERA, filter=FilterState.initial(), truth=True, heatmaps=True)
        )
        assert not estimate.joints.any()
        assert estimate.visible.all()
        assert (estimate.heatmaps == SOMEBODY.output.heatmaps).all()

    def test_says_how_long_each_stage_took(self, client):
        timings = client.call(OBSERVE).timings
        assert set(timings) == {"render", "transport", "infer", "decode", "lift", "qoe", "filter"}
        assert timings["render"] == 0.125
        assert all(seconds > 0 for seconds in timings.values())

    @pytest.mark.slow
    def test_is_perceive_of_the_same_frame(self, client):
        observed = client.call(OBSERVE)
        frame = render(Render(scene=SCENE, camera=CAMERA))
        perceived = client.call(Perceive(frame=frame, filter=FilterState.initial()))
        for name in ("keypoints", "points", "quality"):
            assert getattr(observed, name).tobytes() == getattr(perceived, name).tobytes()
        assert observed.filter.mean.tobytes() == perceived.filter.mean.tobytes()


class TestRenderWorkerInTrouble:
    @pytest.mark.slow
    def test_one_that_does_not_answer_is_named_and_asked_again(self, addresses):
        with (
            perceiving(addresses, SOMEBODY, render_deadline=0.2) as client,
            pytest.raises(DeadlineExceeded, match=f"render at {addresses[0]} did not answer") as caught,
        ):
            client.call(OBSERVE, deadline=1.5)
        assert client.statistics.retries > 0
        assert "deadline-exceeded" in str(caught.value)

    def test_what_it_refuses_is_refused_with_its_reason(self, addresses):
        def refuse(request):
            raise InvalidInput("there is no ground called lava")

        with (
            serving({Render: refuse}, addresses[0], role=Role.RENDER),
            perceiving(addresses, SOMEBODY) as client,
            pytest.raises(Rejected, match="no ground called lava") as caught,
        ):
            client.call(OBSERVE)
        assert caught.value.code == "invalid-input"
        assert not caught.value.retryable


def test_one_frame_is_rendered_while_another_is_inferred(addresses):
    both_rendered = threading.Event()
    renders = []

    def count(request):
        renders.append(request)
        if len(renders) == 2:
            both_rendered.set()
        return render(request)

    class WaitsForTheOther(DrawnNetwork):
        def infer(self, image):
            assert both_rendered.wait(20), "the second frame was not asked for while the first was inferred"
            return super().infer(image)

    with (
        serving({Render: count}, addresses[0], role=Role.RENDER),
        perceiving(addresses, WaitsForTheOther(person(20, 14)), concurrency=2) as client,
    ):
        estimates = list(client.map([OBSERVE, OBSERVE]))
    assert all(estimate.filter.seen.all() for estimate in estimates)


def test_the_command_line_needs_somebody_who_draws(capsys):
    with pytest.raises(SystemExit) as ended_by:
        main(["--bind", "ipc:///tmp/perception"])
    assert ended_by.value.code == 2
    assert "Give --render, or --orchestrator" in capsys.readouterr().err


def test_the_command_line_takes_a_port_for_monitors_and_nothing_else(capsys):
    with pytest.raises(SystemExit) as ended_by:
        main(["--bind", "ipc:///tmp/perception", "--render", "ipc:///tmp/render", "--http", "somewhere"])
    assert ended_by.value.code == 2
    assert "'somewhere' is not an HTTP endpoint" in capsys.readouterr().err


def test_the_command_line_knows_how_frames_may_come(capsys):
    with pytest.raises(SystemExit) as ended_by:
        main(["--bind", "ipc:///tmp/perception", "--render", "ipc:///tmp/render", "--frames", "png"])
    assert ended_by.value.code == 2
    assert "lossless" in capsys.readouterr().err


def test_a_renderer_that_hangs_is_told_before_its_perceiver_seems_to():
    """Else both would be stuck for as long, and both would be killed."""
    for timeouts in (Timeouts(call=30.0, progress=20.0), Timeouts(call=10.0, progress=20.0)):
        assert render_deadline(timeouts) < min(timeouts.call, timeouts.progress)


def last_error(process):
    """What the process said last, once it has ended by itself."""
    _, stderr = process.communicate(timeout=60)
    line = json.loads(stderr.splitlines()[-1])
    assert line["level"] == "error"
    return line["message"]


@pytest.mark.slow
class TestProcess:
    @pytest.fixture
    def photographer(self, addresses, astronaut, frame):
        """A render worker whose every frame is the same photograph, beside black."""
        rgb = np.zeros((480, 640, 3), np.uint8)
        rgb[: astronaut.shape[0], : astronaut.shape[1]] = astronaut
        picture = replace(frame(rgb), camera=CAMERA)
        with serving({Render: lambda request: picture}, addresses[0], role=Role.RENDER):
            yield

    def arguments(self, addresses):
        return "--bind", addresses[1], "--render", addresses[0]

    def test_observes_a_photograph_and_ends_at_sigterm(self, addresses, photographer):
        with running("perception_worker", *self.arguments(addresses)) as process:
            with Client(addresses[1], role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as client:
                welcome = client.wait_ready()
                estimate = client.call(OBSERVE)
            assert welcome.capabilities["network"] == "openpose_mobilenet_thin_5"
            assert estimate.keypoints[Joint.NOSE] == pytest.approx([169, 94], abs=6)
            process.send_signal(signal.SIGTERM)
            assert process.wait(30) == 0

    def test_asks_for_frames_as_the_command_line_says_or_else_the_configuration(self, addresses, tmp_path):
        config, asked = tmp_path / "config.toml", []
        config.write_text('[perception]\nframes = "jpeg"\n')

        def note(request):
            asked.append(request.encoding)
            return pack(render(request), request.encoding)

        with serving({Render: note}, addresses[0], role=Role.RENDER):
            for options in ((), ("--frames", "lossless")):
                arguments = (*self.arguments(addresses), "--config", config, *options)
                with (
                    running("perception_worker", *arguments),
                    Client(addresses[1], role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as client,
                ):
                    assert client.wait_ready().capabilities["frames"] == "none lossless jpeg"
                    client.call(OBSERVE)
        # Each of them for more parts than one: nobody is in the first.
        assert list(dict.fromkeys(asked)) == ["jpeg", "lossless"]

    def test_two_processes_give_the_same_bytes(self, addresses, photographer):
        results = []
        for _ in range(2):
            with (
                running("perception_worker", *self.arguments(addresses)),
                Client(addresses[1], role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as client,
            ):
                results.append(client.call(OBSERVE))
        one, other = results
        assert one.quality.tobytes() == other.quality.tobytes()
        assert one.filter.mean.tobytes() == other.filter.mean.tobytes()

    def test_is_not_ready_before_its_render_worker_is(self, addresses):
        with (
            running("perception_worker", *self.arguments(addresses)),
            Client(addresses[1], role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as client,
        ):
            assert client.ping().state is State.STARTING
            with serving({Render: render}, addresses[0], role=Role.RENDER):
                client.wait_ready()
                pong = client.ping()
                assert (pong.state, pong.lacks) == (State.READY, ())
            wait_until(lambda: client.ping().lacks == (Role.RENDER,))

    def test_tells_monitors_that_it_is_ready_only_while_its_render_worker_is(self, addresses):
        at = free_endpoint()
        arguments = (*self.arguments(addresses), "--name", "perception-7", "--http", at)
        with running("perception_worker", *arguments) as process, monitoring(at) as monitor:
            wait_until(monitor.answers)
            assert monitor.waits_on() == {"start", "render"}
            for _ in range(2):
                with serving({Render: render}, addresses[0], role=Role.RENDER):
                    wait_until(monitor.is_ready, seconds=60)
                wait_until(lambda: monitor.waits_on() == {"render"})
            told = monitor.json("/info")
            assert (told["name"], told["pid"], told["calls"]) == (
                "perception-7",
                process.pid,
                {"render": [addresses[0]]},
            )
            assert told["capabilities"]["network"] == "openpose_mobilenet_thin_5"

    def test_learns_of_its_render_worker_from_the_orchestrator_and_ends_with_it(
        self, addresses, photographer, tmp_path
    ):
        orchestrator, config = f"ipc://{tmp_path}/orchestrator", tmp_path / "config.toml"
        config.write_text("[timeouts]\ngrace = 1.0\nliveness = 1.0\nheartbeat = 0.1\n")
        registry = Registry()
        registry.table["render-0"] = record("render-0", addresses[0], Role.RENDER)
        arguments = "--bind", addresses[1], "--orchestrator", orchestrator, "--name", "perception-7"
        with running("perception_worker", *arguments, "--config", config) as process:
            with (
                serving(registry.handlers(), orchestrator, role=Role.ORCHESTRATOR),
                Client(addresses[1], role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as client,
            ):
                assert client.call(OBSERVE).filter.seen.any()
                wait_until(lambda: registry.state("perception-7") is State.READY)
            assert registry.table["perception-7"].address == addresses[1]
            assert process.wait(20) == ExitCode.DONE

    def test_without_a_render_worker_ends_by_naming_its_address(self, addresses, tmp_path):
        config = tmp_path / "config.toml"
        config.write_text("[timeouts]\nstartup = 0.5\n")
        with running("perception_worker", *self.arguments(addresses), "--config", config) as process:
            assert addresses[0] in last_error(process)
        assert process.returncode == ExitCode.FAILED

    def test_names_a_render_worker_that_was_lost_before_its_caller_gives_up(self, addresses, tmp_path):
        config = tmp_path / "config.toml"
        config.write_text("[timeouts]\ncall = 2.0\n")
        with running("perception_worker", *self.arguments(addresses), "--config", config):
            timeouts = Timeouts(call=2.0, startup=60.0)
            with Client(addresses[1], role=Role.AGENT, serves=Role.PERCEPTION, timeouts=timeouts) as client:
                with serving({Render: render}, addresses[0], role=Role.RENDER):
                    client.wait_ready()
                with pytest.raises(DeadlineExceeded, match=f"render at {addresses[0]}"):
                    client.call(OBSERVE)

    def test_without_the_network_ends_by_naming_the_command(self, addresses, tmp_path):
        with running("perception_worker", *self.arguments(addresses), VANTAGE_CACHE=str(tmp_path)) as process:
            assert "orchestrator models pull" in last_error(process)
        assert process.returncode == 2

    def test_with_another_kind_of_network_ends_by_naming_its_outputs(self, addresses, logits_onnx):
        with running("perception_worker", *self.arguments(addresses), "--network", logits_onnx) as process:
            assert "gives logits" in last_error(process)
        assert process.returncode == 2

    @pytest.fixture
    def lifting_surfaces(self, tmp_path):
        """The arguments by which a worker does so."""
        config = tmp_path / "surfaces.toml"
        config.write_text("[perception]\nlifting = 'nearest'\n")
        return "--config", config

    def test_with_a_calibration_of_another_setting_ends_by_naming_both(self, addresses, lifting_surfaces, tmp_path):
        file = tmp_path / "another.msgpack"
        file.write_bytes(msgspec.msgpack.encode(stored(setting=replace(SETTING, lifting="median"))))
        arguments = *self.arguments(addresses), *lifting_surfaces, "--calibration", file
        with running("perception_worker", *arguments) as process:
            assert "was fitted for" in last_error(process)
        assert process.returncode == 2

    def test_with_a_calibration_that_its_lifter_has_no_use_for_ends_by_saying_so(self, addresses, tmp_path):
        file = tmp_path / "fitting.msgpack"
        file.write_bytes(msgspec.msgpack.encode(stored()))
        with running("perception_worker", *self.arguments(addresses), "--calibration", file) as process:
            assert "lifter tells its own" in last_error(process)
        assert process.returncode == 2

    def test_tells_errors_in_metres_unless_it_is_told_not_to(self, addresses, lifting_surfaces, photographer):
        told = {}
        for calibration in ("auto", "none"):
            arguments = *self.arguments(addresses), *lifting_surfaces, "--calibration", calibration
            with (
                running("perception_worker", *arguments),
                Client(addresses[1], role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as client,
            ):
                told[calibration] = client.call(OBSERVE)
        located = np.isfinite(told["auto"].points[:, 0])
        assert (np.isfinite(told["auto"].radius) == located).all()
        assert (told["auto"].radius[located] > 0).all()
        assert told["none"].expected_error is None
        assert told["none"].radius is None

    def test_with_an_unknown_setting_ends_by_naming_it(self, addresses, tmp_path):
        config = tmp_path / "config.toml"
        config.write_text("[perception]\nnet = 1\n")
        with running("perception_worker", *self.arguments(addresses), "--config", config) as process:
            assert "net" in last_error(process)
        assert process.returncode == 2

    def test_at_an_address_in_use_ends_by_naming_it(self, addresses):
        with (
            serving({Render: render}, addresses[0], role=Role.RENDER),
            serving({Perceive: render}, addresses[1], role=Role.PERCEPTION),
            running("perception_worker", *self.arguments(addresses)) as process,
        ):
            assert addresses[1] in last_error(process)
        assert process.returncode == 2
