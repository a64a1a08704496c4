"""What was made once for a run of weeks and is gone one day: sockets, and the directory that they are in."""

import fcntl
import os
import shutil
import signal
import subprocess
import tempfile
import time

import pytest

from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.socket_directory import run_sockets, socket_directory, sockets_of
from protocol import Client
from protocol.errors import DeadlineExceeded
from protocol.messages import Role
from protocol.server.socket_file import CHECK_EVERY
from protocol.timeouts import Timeouts
from tests.orchestrator.conftest import Command, processes_in
from tests.serving import serving

PATIENCE = 60.0
CONFIG = """
[timeouts]
heartbeat = 0.1
grace = 5.0

[training]
steps = 100000
"""


def wait_until(condition) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "what was waited for did not happen"
        time.sleep(0.05)


@pytest.fixture
def command(tmp_path_factory):
    # Sockets need a short path, which a test's own folder may not have.
    command = Command(tmp_path_factory.mktemp("o"))
    yield command
    for process in processes_in(command.folder):
        process.kill()
    for child in command.children:
        child.communicate(timeout=PATIENCE)


@pytest.fixture
def sockets(tmp_path_factory):
    folder = tmp_path_factory.mktemp("s") / "sockets"
    folder.mkdir(mode=0o700)
    return folder


def client_of(address: str) -> Client:
    return Client(address, role=Role.AGENT, serves=Role.RENDER, timeouts=Timeouts(call=3.0))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["render-0", "perception-0", "agent"])
def test_a_run_whose_sockets_are_removed_replaces_who_dies_then(command, monkeypatch, name):
    (command.folder / "short.toml").write_text(CONFIG)
    run = RunDirectory(command.folder / "one")
    child = command.start("train", "short.toml", "--run", "one", "--no-evaluate")
    wait_until(lambda: run.progress() is not None or child.poll() is not None)
    assert child.poll() is None, child.communicate()[1]
    monkeypatch.setattr(tempfile, "tempdir", str(command.temporary))
    before = {process.name: process.pid for process in run.processes()}
    shutil.rmtree(sockets_of(run.path))
    os.kill(before[name], signal.SIGKILL)
    wait_until(lambda: bool(run.restarts()))
    reached = run.progress()
    # For longer than the grace of whoever finds no orchestrator.
    ends = time.monotonic() + 2 * 5.0
    wait_until(lambda: time.monotonic() >= ends and run.progress() != reached)
    assert child.poll() is None, child.communicate()[1]
    assert [restart.process for restart in run.restarts()] == [name]
    after = {process.name: process.pid for process in run.processes()}
    assert {other for other in after if after[other] != before[other]} == {name}
    there = {path.name for path in sockets_of(run.path).iterdir()}
    assert there == {"orchestrator", "render-0", "perception-0"}


@pytest.mark.slow
def test_a_workers_socket_is_put_back_and_whoever_is_connected_notices_nothing(sockets):
    address = f"ipc://{sockets}/render"
    with serving({}, address, role=Role.RENDER), client_of(address) as connected:
        connected.wait_ready()
        incarnation = connected.ping().incarnation
        shutil.rmtree(sockets)
        wait_until(lambda: (sockets / "render").is_socket())
        assert sockets.stat().st_mode & 0o777 == 0o700
        assert connected.ping().incarnation == incarnation
        with client_of(address) as new:
            assert new.wait_ready().incarnation == incarnation
    assert not (sockets / "render").exists()


@pytest.mark.slow
def test_a_socket_is_not_restored_in_a_directory_that_others_may_write_to(sockets, caplog):
    address = f"ipc://{sockets}/render"
    with serving({}, address, role=Role.RENDER), client_of(address) as connected:
        connected.wait_ready()
        shutil.rmtree(sockets)
        sockets.mkdir()
        sockets.chmod(0o777)
        wait_until(lambda: "can't be restored" in caplog.text)
        time.sleep(2 * CHECK_EVERY)
        assert not (sockets / "render").exists()
        assert caplog.text.count("can't be restored") == 1
        with client_of(address) as new, pytest.raises(DeadlineExceeded):
            new.ping()
        sockets.chmod(0o700)
        wait_until(lambda: (sockets / "render").is_socket())


def is_locked(directory) -> bool:
    """Whether a cleaner that asks for a directory's lock first would pass it over."""
    descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def test_cleaners_pass_over_the_sockets_of_a_run_for_as_long_as_it_goes_on(tmp_path):
    with run_sockets(tmp_path / "run") as first:
        with run_sockets(tmp_path / "run"):
            assert is_locked(first)
        first.mkdir()
        assert not is_locked(first)
    with socket_directory() as directory:
        assert is_locked(directory)


@pytest.mark.slow
def test_systemd_tmpfiles_itself_passes_them_over(tmp_path, tmp_path_factory, monkeypatch):
    cleaner = shutil.which("systemd-tmpfiles")
    if cleaner is None:
        pytest.skip("not run: there is no systemd-tmpfiles")
    temporary = tmp_path_factory.mktemp("t")
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    rules = tmp_path / "rules.conf"
    rules.write_text(f"d {temporary} 0700 - - 0\n")
    (temporary / "unlocked").mkdir()
    with run_sockets(tmp_path / "run") as directory:
        (directory / "a-file").touch()
        subprocess.run([cleaner, "--clean", str(rules)], check=True)
        assert [path.name for path in temporary.iterdir()] == [directory.name]
        assert (directory / "a-file").exists()
