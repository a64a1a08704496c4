"""A process that may open few files (`ulimit -n`): it says so, or its calls end by their deadlines; it never hangs."""

import resource
import subprocess
import sys

import pytest

from orchestrator.run.run_directory import RunDirectory
from protocol.errors import Unavailable
from protocol.messages import Role, Sampled, SampleScene
from protocol.system.descriptors import require_descriptors
from tests.agent.analytic_sensor import AnalyticSensor
from tests.orchestrator.conftest import Command, processes_in
from tests.serving import serving

PATIENCE = 60.0
OPENS_MORE_AND_MORE = """
import resource, sys
from protocol import Pool
from protocol.errors import DeadlineExceeded, Unavailable
from protocol.messages import Role, SampleScene

limit = int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit))
pools = []
try:
    for number in range(20):
        pools.append(Pool([f"{sys.argv[2]}-{number}"], role=Role.AGENT, serves=Role.RENDER))
except Unavailable as error:
    assert "ulimit -n" in str(error)
try:
    pools[-1].call(SampleScene(seed=1, split="train"), deadline=0.2) if pools else None
except DeadlineExceeded:
    pass
for pool in pools:
    pool.close()
"""
IS_SHORT_OF_FILES_FOR_A_WHILE = """
import os, resource, sys
from protocol import Client
from protocol.errors import DeadlineExceeded
from protocol.messages import Role, SampleScene

def ask(deadline):
    return client.call(SampleScene(seed=1, split="train"), deadline=deadline)

client = Client(sys.argv[1], role=Role.AGENT, serves=Role.RENDER)
ask(30.0)
soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
resource.setrlimit(resource.RLIMIT_NOFILE, (max(map(int, os.listdir("/proc/self/fd"))) + 2, hard))
print("short", flush=True)
input()
try:
    ask(2.0)
except DeadlineExceeded:
    print("late", flush=True)
resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
ask(30.0)
print("answered", flush=True)
"""


def test_so_few_are_free_that_it_is_said_how_to_have_more():
    with pytest.raises(Unavailable, match="raise the limit by 'ulimit -n 4096'"):
        require_descriptors(resource.getrlimit(resource.RLIMIT_NOFILE)[0] + 1)
    require_descriptors()


@pytest.mark.slow
@pytest.mark.parametrize("limit", [6, 12, 14, 18, 24, 30, 36, 40, 52, 64])
def test_a_client_says_so_whichever_file_it_lacks(tmp_path_factory, limit):
    address = f"ipc://{tmp_path_factory.mktemp('s')}/nobody"
    ended = subprocess.run(
        [sys.executable, "-c", OPENS_MORE_AND_MORE, str(limit), address],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr


@pytest.mark.slow
def test_a_client_that_lacks_files_for_a_while_connects_again_afterwards(tmp_path_factory):
    address = f"ipc://{tmp_path_factory.mktemp('s')}/render"
    sensor = AnalyticSensor()
    scenes = {SampleScene: lambda asked: Sampled(scene=sensor.sample(asked.seed, asked.split))}
    client = subprocess.Popen(
        [sys.executable, "-c", IS_SHORT_OF_FILES_FOR_A_WHILE, address],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with client:
        assert client.stdin is not None
        assert client.stdout is not None
        with serving(scenes, address, role=Role.RENDER):
            assert client.stdout.readline() == "short\n"
        with serving(scenes, address, role=Role.RENDER):
            print(file=client.stdin, flush=True)
            assert [client.stdout.readline() for _ in range(2)] == ["late\n", "answered\n"]
        assert client.wait(PATIENCE) == 0


@pytest.mark.slow
def test_a_training_says_so_and_leaves_nobody_behind(tmp_path_factory):
    command = Command(tmp_path_factory.mktemp("o"))
    (command.folder / "short.toml").write_text("[training]\nsteps = 20\n")
    child = command.start(
        "train", "short.toml", "--run", "one", "--no-evaluate", before=("sh", "-c", 'ulimit -n 32; exec "$0" "$@"')
    )
    _, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 1
    said, how_to_go_on = err.splitlines()[-2:]
    assert said.startswith("this process can open no more files and sockets")
    assert how_to_go_on == "continue the run by 'orchestrator resume one'"
    assert not RunDirectory(command.folder / "one").is_busy()
    assert processes_in(command.folder) == []
