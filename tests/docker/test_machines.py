"""A profile for each machine: four projects that share a network and a variable, each with its own role's key alone."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.docker.stack import HERE, SERVICES, Stack
from tests.docker.waiting import wait

NETWORK = "machines"
VARIABLE = {"VANTAGE_ORCHESTRATOR": "tcp://orchestrator-machine-orchestrator-1:5600"}


@pytest.fixture
def machines(images, tmp_path) -> Iterator[dict[str, Stack]]:
    """A project for each role, with a folder of keys in which there is what its machine was given."""
    images.run("network", "rm", NETWORK)
    images.docker("network", "create", NETWORK)
    Stack(images, "keys-machine", tmp_path / "all").compose("run", "--rm", "keys")
    projects = {role: machine(images, role, tmp_path) for role in SERVICES}
    try:
        yield projects
    finally:
        for project in projects.values():
            project.remove()
        images.run("network", "rm", NETWORK)


def machine(engine, role: str, folder: Path) -> Stack:
    keys = folder / role
    shutil.copytree(folder / "all" / role, keys / role, copy_function=shutil.copy2)
    for path in (folder / "all" / role).iterdir():
        shutil.chown(keys / role / path.name, 1000, 1000)
    environment = {**VARIABLE, "COMPOSE_PROFILES": role}
    return Stack(
        engine,
        f"{role}-machine",
        keys,
        config=HERE / "tiny.toml",
        files=(HERE / "machines.yaml",),
        environment=environment,
    )


def test_a_profile_on_each_machine_trains_whichever_starts_first(machines):
    for role in ("agent", "perception", "render", "orchestrator"):
        machines[role].compose("up", "--detach", "--no-build")
        assert machines[role].compose("ps", "--services").split() == [role]
    wait(lambda: all(machines[role].exit_code(role) == 0 for role in SERVICES), "the end of all with exit code 0", 400)
    assert (machines["agent"].run_directory() / "weights.safetensors").is_file()
    assert "waiting for a host at tcp://orchestrator-machine-orchestrator-1:5600" in machines["agent"].log("agent")


def test_a_machine_without_its_key_says_so_and_serves_nobody(machines):
    render = machines["render"]
    (Path(render.environment["VANTAGE_KEYS"]) / "render" / "render.key").unlink()
    render.compose("up", "--detach", "--no-build")
    wait(lambda: render.restarts("render") > 0, "the end of the worker")
    assert "can't read the key /run/secrets/keys/render.key" in render.log("render")
