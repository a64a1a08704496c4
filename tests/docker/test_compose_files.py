"""What the compose files come to, before anything runs."""

from collections.abc import Mapping

import pytest

from tests.docker.engine import REPOSITORY, Engine
from tests.docker.stack import SERVICES, Stack

DOCKER = REPOSITORY / "docker"


@pytest.fixture
def project(engine, tmp_path):
    """The project with overrides: what `docker compose WORDS` says of it."""

    def ask(*words: str, overrides: tuple[str, ...] = (), environment: Mapping[str, str] | None = None):
        files = tuple(DOCKER / f"compose.{name}.yaml" for name in overrides)
        return Stack(engine, "files", tmp_path, files=files, environment=environment).try_compose(*words)

    return ask


def test_without_a_profile_all_services_are_there(project):
    assert set(project("config", "--services").stdout.split()) == {"keys", *SERVICES}


@pytest.mark.parametrize("service", SERVICES)
def test_a_profile_is_one_service_alone(project, service):
    said = project("--profile", service, "config", "--services")
    assert said.stdout.split() == [service]


@pytest.mark.parametrize("overrides", [("machines",), ("gpu",), ("machines", "gpu"), ("machines", "jetson")])
def test_every_override_is_valid(project, overrides):
    jetson = {"VANTAGE_JETSON_BASE": "jetpack", "VANTAGE_JETSON_WHEELS": str(DOCKER)}
    said = project("config", "--quiet", overrides=overrides, environment=jetson)
    assert said.returncode == 0, said.stdout


def test_a_jetson_without_its_base_is_told_what_it_needs(project):
    said = project("config", "--quiet", overrides=("jetson",))
    assert said.returncode != 0
    # Whichever of the two it comes to first.
    assert "required variable VANTAGE_JETSON_" in said.stdout
    assert "for this JetPack" in said.stdout or "of its JetPack" in said.stdout


def test_the_stack_is_valid(engine: Engine):
    said = engine.run("stack", "config", "--compose-file", str(DOCKER / "stack.yaml"))
    assert said.returncode == 0, said.stdout
    assert "Ignoring" not in said.stdout
