"""Every real process answers over HTTP as its OpenAPI document says, to whatever schemathesis makes up."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from protocol.telemetry.endpoint import Endpoint
from tests.perception_worker.workers import running
from tests.protocol.processes.waiting import wait_until
from tests.protocol.telemetry.monitors import free_endpoint, monitoring

SCHEMATHESIS = Path(sys.executable).with_name("schemathesis")
# Not being ready is an answer, and no server's error: the document has its 503.
OPTIONS = ("--exclude-checks", "not_a_server_error", "--max-examples", "20", "--seed", "4", "--no-color")
UNTIL_IT_IS_STOPPED = (
    "[environment]\nnum_envs = 2\n[training]\nsteps = 1000000\nprefill = 20\n[learner.sac]\nbatch_size = 16\n"
)

pytestmark = pytest.mark.slow


@pytest.fixture
def start(tmp_path) -> Iterator[Callable[..., Endpoint]]:
    """Starts a process with an HTTP port, and gives that once it answers there."""
    token = tmp_path / "token"
    token.write_text("0123456789abcdef")
    token.chmod(0o600)
    with ExitStack() as processes:

        def start(module: str, *arguments: str | Path) -> Endpoint:
            at = free_endpoint()
            processes.enter_context(running(module, *arguments, "--http", at, VANTAGE_HTTP_TOKEN=str(token)))
            with monitoring(at) as monitor:
                wait_until(monitor.answers, seconds=60)
            return at

        yield start


@pytest.fixture
def assert_keeps_its_document(tmp_path) -> Callable[[Endpoint], None]:
    return lambda at: _test_document(at, tmp_path)


def _test_document(at: Endpoint, folder: Path) -> None:
    command = [SCHEMATHESIS, "run", f"http://{at}/openapi.json", *OPTIONS]
    # It leaves its notes where it stands.
    tested = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=240)
    assert tested.returncode == 0, tested.stdout
    assert "Tested: 5\n" in tested.stdout, tested.stdout
    with monitoring(at) as monitor:
        assert monitor.get("/health/live").status_code == 200


def test_the_workers_and_the_agent_keep_their_documents(start, tmp_path, assert_keeps_its_document):
    render, perception = f"ipc://{tmp_path}/render", f"ipc://{tmp_path}/perception"
    run = tmp_path / "run"
    run.mkdir()
    (run / "config.toml").write_text(UNTIL_IT_IS_STOPPED)
    assert_keeps_its_document(start("render_worker", "--bind", render))
    assert_keeps_its_document(start("perception_worker", "--bind", perception, "--render", render))
    agent = start("agent", "train", "--run", run, "--render", render, "--perception", perception)
    with monitoring(agent) as monitor:
        wait_until(monitor.is_ready, seconds=120)
    assert_keeps_its_document(agent)


def test_the_orchestrator_keeps_its_document(start, tmp_path, assert_keeps_its_document):
    config = tmp_path / "config.toml"
    config.write_text(UNTIL_IT_IS_STOPPED)
    orchestrator = start("orchestrator", "train", config, "--run", tmp_path / "run")
    with monitoring(orchestrator) as monitor:
        wait_until(monitor.is_ready, seconds=120)
    assert_keeps_its_document(orchestrator)


def test_a_host_keeps_its_document(start, tmp_path, assert_keeps_its_document):
    assert_keeps_its_document(start("orchestrator", "host", "--bind", f"ipc://{tmp_path}/host"))
