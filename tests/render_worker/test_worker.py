import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from protocol.client.client import Client
from protocol.errors import Rejected
from protocol.failpoint import Failpoints
from protocol.frame import ENCODINGS
from protocol.messages import Render, Role, SampleScene, State
from protocol.packing.packing import unpack
from protocol.system.exit_code import ExitCode
from render_worker.scenes import sample_scene
from render_worker.worker import answer_sample, draw, main
from tests.protocol.processes.registry import Registry
from tests.protocol.processes.waiting import wait_until
from tests.protocol.telemetry.monitors import free_endpoint, monitoring
from tests.protocol.values.pictures import smooth_frame
from tests.protocol.values.sameness import same
from tests.serving import serving


def worker(*arguments: str, **environment: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "render_worker", *arguments]
    return subprocess.Popen(command, env={**os.environ, **environment}, stderr=subprocess.PIPE, text=True)


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    _, said = process.communicate(timeout=60)
    return process.returncode, said


def test_a_scene_is_sampled_as_asked():
    assert answer_sample(SampleScene(seed=5, split="train")).scene == sample_scene(5, "train")
    asked = SampleScene(seed=5, split="train", bystanders=2)
    assert answer_sample(asked).scene == sample_scene(5, "train", 2)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_the_worker_packs_a_frame_and_says_how_long_that_took(encoding):
    picture = smooth_frame()
    renderer = SimpleNamespace(render=lambda scene, camera, *, region, truth: picture)
    request = Render(scene=sample_scene(3, "test"), camera=picture.camera, encoding=encoding)
    frame = draw(request, renderer)
    assert frame.encoding == encoding
    assert frame.timings.keys() == ({"render"} if encoding == "none" else {"render", "pack"})
    assert unpack(frame).depth.tobytes() == picture.depth.tobytes()


def test_importing_the_room_loads_no_opengl():
    program = "import sys, render_worker; print({'moderngl', 'anny', 'torch'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_an_unknown_setting_ends_the_worker_with_its_name(tmp_path):
    config = tmp_path / "config.toml"
    config.write_text("[render]\nspeed = 9\n")
    code, said = ended(worker("--bind", f"ipc://{tmp_path}/render", "--config", str(config)))
    assert code == 2
    assert "speed" in said


@pytest.fixture(scope="module")
def address(tmp_path_factory) -> Iterator[str]:
    bound = f"ipc://{tmp_path_factory.mktemp('sockets')}/render"
    process = worker("--bind", bound)
    yield bound
    process.terminate()
    assert ended(process)[0] == 0


@pytest.fixture
def client(address) -> Iterator[Client]:
    with Client(address, role=Role.AGENT, serves=Role.RENDER) as opened:
        opened.wait_ready()
        yield opened


@pytest.mark.slow
def test_a_worker_samples_and_draws_what_the_library_does(client, renderer, look_at):
    scene = client.call(SampleScene(seed=3, split="test")).scene
    assert scene == sample_scene(3, "test")
    camera = look_at(scene, 0, 3, size=(160, 120))
    frame = client.call(Render(scene=scene, camera=camera, truth=True))
    expected = renderer.render(scene, camera, truth=True)
    np.testing.assert_array_equal(frame.rgb, expected.rgb)
    np.testing.assert_array_equal(frame.depth, expected.depth)
    np.testing.assert_array_equal(frame.visible, expected.visible)


@pytest.mark.slow
def test_a_frame_comes_as_it_was_asked_for(client, look_at):
    scene = client.call(SampleScene(seed=3, split="test")).scene
    plain, packed, jpeg = (
        client.call(Render(scene=scene, camera=look_at(scene, 0, 3), truth=True, encoding=encoding))
        for encoding in ("none", "lossless", "jpeg")
    )
    assert [frame.encoding for frame in (plain, packed, jpeg)] == ["none", "lossless", "jpeg"]
    assert plain.timings.keys() == {"render"}
    assert packed.timings.keys() == jpeg.timings.keys() == {"render", "pack"}
    opened, seen = unpack(packed), unpack(jpeg)
    assert same(msgspec.structs.replace(opened, timings={}), msgspec.structs.replace(plain, timings={}))
    assert seen.depth.tobytes() == plain.depth.tobytes()
    assert 0 < np.abs(seen.rgb.astype(int) - plain.rgb).mean() < 2


@pytest.mark.slow
def test_a_request_that_can_not_be_drawn_is_refused_and_the_worker_goes_on(client, look_at):
    scene = sample_scene(3, "test")
    camera = look_at(scene, 0, 3, size=(160, 120))
    with pytest.raises(Rejected, match="lava") as refused:
        client.call(Render(scene=msgspec.structs.replace(scene, ground="lava"), camera=camera))
    assert refused.value.code == "invalid-input"
    assert client.call(Render(scene=scene, camera=camera)).rgb.shape == (120, 160, 3)


@pytest.mark.slow
def test_without_egl_the_worker_ends_and_names_the_packages(tmp_path):
    bound = f"ipc://{tmp_path}/render"
    code, said = ended(worker("--bind", bound, __EGL_VENDOR_LIBRARY_FILENAMES="/nonexistent"))
    assert code == 2
    assert "libegl1 libgl1 libgl1-mesa-dri" in said


@pytest.mark.slow
def test_without_bodies_the_worker_ends_and_names_the_command(tmp_path):
    code, said = ended(worker("--bind", f"ipc://{tmp_path}/render", VANTAGE_CACHE=str(tmp_path / "empty")))
    assert code == 2
    assert "orchestrator bodies bake" in said


@pytest.mark.slow
def test_an_address_in_use_ends_the_second_worker(address, client):
    code, said = ended(worker("--bind", address))
    assert code == 2
    assert address in said


@pytest.mark.slow
def test_a_worker_registers_under_its_name_and_ends_with_its_orchestrator(tmp_path):
    bound, orchestrator = f"ipc://{tmp_path}/render", f"ipc://{tmp_path}/orchestrator"
    config = tmp_path / "config.toml"
    config.write_text("[timeouts]\ngrace = 1.0\nliveness = 1.0\nheartbeat = 0.1\n")
    registry = Registry()
    with serving(registry.handlers(), orchestrator, role=Role.ORCHESTRATOR):
        process = worker("--bind", bound, "--config", str(config), "--orchestrator", orchestrator, "--name", "render-1")
        wait_until(lambda: registry.state("render-1") is State.READY)
    record = registry.table["render-1"]
    assert (record.role, record.address, record.pid) == (Role.RENDER, bound, process.pid)
    assert ended(process)[0] == ExitCode.DONE


@pytest.mark.slow
def test_a_failpoint_kills_the_worker_with_a_frame_in_hand(tmp_path, look_at):
    bound = f"ipc://{tmp_path}/render"
    Failpoints(tmp_path).order("reply-render", "kill")
    process = worker("--bind", bound, VANTAGE_FAILPOINTS=str(tmp_path))
    with Client(bound, role=Role.AGENT, serves=Role.RENDER) as client:
        client.submit(SampleScene(seed=3, split="test"))
        assert ended(process)[0] == -signal.SIGKILL


def test_the_command_line_needs_an_address(capsys):
    with pytest.raises(SystemExit) as ended_by:
        main([])
    assert ended_by.value.code == 2
    assert "--bind" in capsys.readouterr().err


def test_the_command_line_takes_a_port_for_monitors_and_nothing_else(capsys):
    with pytest.raises(SystemExit) as ended_by:
        main(["--bind", "ipc:///tmp/render", "--http", "somewhere"])
    assert ended_by.value.code == 2
    assert "'somewhere' is not an HTTP endpoint" in capsys.readouterr().err


def test_a_port_in_use_ends_the_worker_before_it_loads_anything(tmp_path):
    at = free_endpoint()
    with closing(socket.create_server((at.host, at.port))):
        assert main(["--bind", f"ipc://{tmp_path}/render", "--http", str(at.port)]) == ExitCode.HOPELESS


@pytest.mark.slow
def test_a_worker_ends_in_order_for_who_shows_the_token_over_http(tmp_path):
    token, at = tmp_path / "token", free_endpoint()
    token.write_text("0123456789abcdef\n")
    token.chmod(0o600)
    process = worker("--bind", f"ipc://{tmp_path}/render", "--http", str(at.port), "--http-token", str(token))
    with monitoring(at) as monitor:
        wait_until(monitor.is_ready, seconds=60)
        assert monitor.post("/control/stop").status_code == 401
        assert monitor.is_ready()
        assert monitor.post("/control/stop", Authorization="Bearer 0123456789abcdef").status_code == 202
    code, log = ended(process)
    assert code == ExitCode.DONE
    assert "0123456789abcdef" not in log


@pytest.mark.slow
def test_a_worker_tells_monitors_how_it_is(tmp_path, look_at):
    bound, at = f"ipc://{tmp_path}/render", free_endpoint()
    process = worker("--bind", bound, "--name", "render-3", "--http", str(at.port))
    with monitoring(at) as monitor, Client(bound, role=Role.AGENT, serves=Role.RENDER) as client:
        wait_until(monitor.is_ready, seconds=60)
        told = monitor.json("/info")
        assert (told["name"], told["serves"], told["pid"]) == ("render-3", [bound], process.pid)
        assert told["capabilities"] == {"renderer": "opengl"}
        client.call(Render(scene=sample_scene(3, "test"), camera=look_at(sample_scene(3, "test"), 0, 3)))
        answered = {"type": "Render", "outcome": "answered", "code": ""}
        wait_until(lambda: monitor.metric("vantage_requests_total", **answered) == 1)
    process.terminate()
    assert ended(process)[0] == ExitCode.DONE
