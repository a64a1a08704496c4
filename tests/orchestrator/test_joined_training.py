"""A training with a host and workers that it did not start. Processes are real, the rooms stand-ins but at the end."""

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from orchestrator.chaos.comparison import compare
from orchestrator.run.run_directory import RunDirectory
from tests.orchestrator.conftest import Command
from tests.protocol.security.deployment import free_port
from tests.protocol.telemetry.monitors import free_endpoint, monitoring

pytestmark = pytest.mark.slow

SHORT = """
[timeouts]
heartbeat = 0.1
startup = {startup}
grace = {grace}

[training]
steps = {steps}

[evaluation]
episodes = 3
baselines = ["stay"]
"""
REAL = """
[environment]
num_envs = 2
episode_steps = 8

[learner.sac]
batch_size = 8

[training]
steps = 40
prefill = 16
log_every = 8
checkpoint_every = 8
"""
JOURNAL_ROWS, DRONES = 28, 2
CLOCK_FAR_OFF, TEN_YEARS = str(Path(__file__).parent / "clock_far_off"), 10 * 365 * 86400
PATIENCE = 120.0


class Site:
    """A host at an address of its own, and the processes that register with it."""

    def __init__(self, command: Command, rooms: tuple[str, ...] | None = ()) -> None:
        self.command = command
        self.address = f"tcp://127.0.0.1:{free_port()}"
        self.run = RunDirectory(command.folder / "one")
        self._rooms = rooms

    def wait_until(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, "what was waited for did not happen"
            time.sleep(0.02)

    def configure(self, text: str = SHORT, steps: int = 150, startup: float = 30.0, grace: float = 30.0) -> None:
        text = text.format(steps=steps, startup=startup, grace=grace)
        (self.command.folder / "short.toml").write_text(text)

    def host(self, *options: str) -> subprocess.Popen[str]:
        return self.command.start("host", "--bind", self.address, *options, rooms=self._rooms)

    def worker(self, role: str) -> subprocess.Popen[str]:
        bind = f"tcp://127.0.0.1:{free_port()}"
        options = ("--bind", bind, "--orchestrator", self.address, "--name", f"{role}-0")
        return self.command.start(*options, rooms=self._rooms, module=f"{role}_worker")

    def workers(self) -> list[subprocess.Popen[str]]:
        return [self.worker("render"), self.worker("perception")]

    def train(self, *options: str, run: str = "one") -> subprocess.Popen[str]:
        join = ("--join", self.address, "--run", run, "--or-resume")
        return self.command.start("train", "short.toml", *join, "--json", *options, rooms=self._rooms)

    def resume(self) -> subprocess.Popen[str]:
        return self.command.start("resume", "one", "--join", self.address, "--json", rooms=self._rooms)

    def wait_for_steps(self, run: RunDirectory | None = None, steps: int = 1) -> None:
        def there() -> bool:
            progress = (run or self.run).progress()
            return progress is not None and progress.step >= steps

        self.wait_until(there)


@pytest.fixture
def site(orchestrator) -> Site:
    return Site(orchestrator)


def ended(child: subprocess.Popen[str]) -> tuple[int, str, str]:
    out, err = child.communicate(timeout=PATIENCE)
    return child.returncode, out, err


def report(child: subprocess.Popen[str]) -> dict:
    code, out, err = ended(child)
    assert code == 0, err
    return json.loads(out)


def ends_well(child: subprocess.Popen[str]) -> None:
    code, _, err = ended(child)
    assert code == 0, err


def are_dismissed(*workers: subprocess.Popen[str]) -> None:
    """They end well, and not as orphans, which would end well too."""
    for worker in workers:
        code, _, err = ended(worker)
        assert (code, "the run is over" in err) == (0, True), err


def test_a_joined_run_starts_the_agent_alone_and_all_end_well_once_it_is_done(site):
    site.configure()
    host, workers, at = site.host(), site.workers(), free_endpoint()
    run = site.train("--http", str(at.port))
    with monitoring(at) as monitor:
        site.wait_until(lambda: monitor.is_ready() or run.poll() is not None)
        assert monitor.metric("vantage_processes", role="perception", at_work="true") == 1
    told = report(run)
    assert (told["steps"], told["restarts"]) == (150, {})
    assert {score["policy"] for score in told["evaluation"]["scores"]} == {"trained", "stay"}
    assert {process.name for process in site.run.processes()} == {"agent", "evaluation"}
    code, _, err = ended(host)
    assert (code, "one is done" in err, "no worker is left; ending" in err) == (0, True, True)
    are_dismissed(*workers)
    assert site.command.alive() == set()


def test_a_host_that_is_killed_in_the_middle_changes_nothing(site):
    site.configure(steps=600)
    host, workers, run = site.host(), site.workers(), site.train()
    site.wait_for_steps()
    host.kill()
    host.communicate(timeout=PATIENCE)
    here = site.run.progress().step
    site.wait_for_steps(steps=here + 100)
    host = site.host()
    told = report(run)
    assert (told["steps"], told["restarts"]) == (600, {})
    ends_well(host)
    are_dismissed(*workers)


def test_a_killed_run_goes_on_by_the_same_command_and_its_agent_is_taken_up(site):
    site.configure(steps=600)
    host, workers, run = site.host(), site.workers(), site.train()
    site.wait_for_steps()
    agent = site.run.processes()[0].pid
    run.kill()
    run.communicate(timeout=PATIENCE)
    told = report(site.train())
    assert (told["steps"], told["restarts"]) == (600, {})
    assert f"adopted agent, as process {agent}" in site.run.orchestrator_log.read_text()
    ends_well(host)
    are_dismissed(*workers)


def test_a_run_that_is_done_says_so_again_and_no_worker_waits_for_ever(site):
    site.configure(steps=20)
    host, workers = site.host("--stay"), site.workers()
    first = report(site.train())
    host.send_signal(signal.SIGTERM)
    ends_well(host)
    host = site.host()
    assert report(site.resume()) == first
    ends_well(host)
    are_dismissed(*workers)


def test_a_second_run_is_waited_for(site):
    site.configure(steps=400)
    host, workers, longer = site.host(), site.workers(), site.train(run="longer")
    site.wait_for_steps(RunDirectory(site.command.folder / "longer"))
    site.configure(steps=20)
    assert report(site.train())["steps"] == 20
    assert host.poll() is None
    told = report(longer)
    assert (told["steps"], told["restarts"]) == (400, {})
    ends_well(host)
    are_dismissed(*workers)


def test_a_run_that_is_stopped_dismisses_nobody_and_a_host_ends_well_on_sigterm(site):
    site.configure(steps=100_000)
    host, workers, run = site.host(), site.workers(), site.train()
    site.wait_for_steps()
    run.send_signal(signal.SIGINT)
    assert ended(run)[0] == 130
    assert [child.poll() for child in (host, *workers)] == [None, None, None]
    host.send_signal(signal.SIGTERM)
    code, _, err = ended(host)
    assert (code, "is done" in err) == (0, False)
    assert [worker.poll() for worker in workers] == [None, None]


def test_a_host_that_is_gone_for_good_ends_the_run_while_its_agent_can_still_write_what_it_learned(site):
    site.configure(steps=100_000, grace=1.0)
    host, _, run = site.host(), site.workers(), site.train()
    site.wait_for_steps()
    host.kill()
    host.communicate(timeout=PATIENCE)
    code, _, err = ended(run)
    assert (code, "has not answered for 1 s (timeouts.grace)" in err) == (1, True)
    summary = site.run.summary()
    assert summary is not None
    assert not summary.complete


def test_without_a_host_the_wait_says_what_for_and_ends_in_time(site):
    site.configure(startup=1.0)
    code, out, err = ended(site.train())
    assert (code, out) == (1, "")
    waited = f"a host at {site.address} (no answer: does 'orchestrator host' run there?)"
    assert f"waiting for {waited}" in err
    assert f"waited 1 s (timeouts.startup) in vain for {waited}" in err
    assert f"continue the run by 'orchestrator resume one --join {site.address}'" in err


def test_a_name_that_means_no_machine_is_told(site):
    site.configure(startup=2.0)
    site.address = "tcp://no-such.invalid:5600"
    code, _, err = ended(site.train("--insecure"))
    assert code == 1
    assert "in vain for a host at tcp://no-such.invalid:5600 (the name 'no-such.invalid' is unknown" in err


def test_a_worker_that_never_comes_is_named(site):
    site.configure(startup=3.0)
    site.host()
    site.worker("render")
    code, _, err = ended(site.train())
    assert code == 1
    assert f"in vain for a perception worker to be ready, at the host {site.address} (render-0 is ready)" in err


def test_a_run_of_another_configuration_is_not_gone_on_with(site):
    site.configure(startup=1.0)
    assert ended(site.train())[0] == 1
    site.configure(startup=2.0)
    code, _, err = ended(site.train())
    assert (code, "one was made with another configuration" in err) == (2, True)


def test_a_host_ends_in_order_for_who_shows_the_token_over_http(site, tmp_path):
    token, at = tmp_path / "token", free_endpoint()
    token.write_text("0123456789abcdef")
    token.chmod(0o600)
    host = site.host("--http", str(at), "--http-token", str(token))
    with monitoring(at) as monitor:
        site.wait_until(monitor.is_ready)
        assert monitor.post("/control/stop", Authorization="Bearer fedcba9876543210").status_code == 401
        assert monitor.post("/control/stop", Authorization="Bearer 0123456789abcdef").status_code == 202
    assert ended(host)[0] == 0


@pytest.fixture(scope="module")
def alone(tmp_path_factory) -> Path:
    """A real run whose workers were started with it."""
    command = Command(tmp_path_factory.mktemp("a"))
    (command.folder / "short.toml").write_text(REAL)
    done = command.run("train", "short.toml", "--run", "alone", "--no-evaluate", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    return command.folder / "alone"


@pytest.fixture
def real_site(orchestrator) -> Site:
    site = Site(orchestrator, rooms=None)
    site.configure(REAL)
    return site


def test_a_real_joined_training_ends_as_one_that_starts_its_workers(real_site, alone):
    host, workers = real_site.host(), real_site.workers()
    assert report(real_site.train("--no-evaluate"))["restarts"] == {}
    ends_well(host)
    are_dismissed(*workers)
    assert same(alone, real_site.run.path)


def test_and_also_if_host_orchestrator_and_agent_are_killed_in_it(real_site, alone):
    host, workers, run = real_site.host(), real_site.workers(), real_site.train("--no-evaluate")
    real_site.wait_for_steps(steps=12)
    for child in (host, run):
        child.kill()
        child.communicate(timeout=PATIENCE)
    os.kill(real_site.run.processes()[0].pid, signal.SIGKILL)
    host, run = real_site.host(), real_site.train("--no-evaluate")
    assert report(run)["steps"] == 40
    ends_well(host)
    are_dismissed(*workers)
    assert same(alone, real_site.run.path)


def test_and_also_if_a_worker_is_away_for_longer_than_a_call_may_take(real_site, alone):
    real_site.configure(REAL + "[timeouts]\ncall = 2.0\nheartbeat = 0.1\n")
    host, (render, perception), run = real_site.host(), real_site.workers(), real_site.train("--no-evaluate")
    real_site.wait_for_steps(steps=12)
    render.kill()
    render.communicate(timeout=PATIENCE)
    real_site.wait_until(lambda: bool(real_site.run.restarts()))
    assert {restart.process for restart in real_site.run.restarts()} == {"agent"}
    render = real_site.worker("render")
    assert report(run)["steps"] == 40
    ends_well(host)
    are_dismissed(render, perception)
    assert same(alone, real_site.run.path)


def test_and_also_if_the_workers_clocks_are_ten_years_off(real_site, alone, monkeypatch):
    host = real_site.host()
    with monkeypatch.context() as elsewhere:
        elsewhere.setenv("PYTHONPATH", os.pathsep.join(filter(None, [CLOCK_FAR_OFF, os.environ.get("PYTHONPATH")])))
        workers = real_site.workers()
    assert report(real_site.train("--no-evaluate"))["restarts"] == {}
    ends_well(host)
    for worker in workers:
        code, _, log = ended(worker)
        assert code == 0, log
        assert json.loads(log.splitlines()[0])["time"] > time.time() + TEN_YEARS / 2
    assert same(alone, real_site.run.path)


def same(alone: Path, joined: Path) -> bool:
    comparison = compare(alone, joined, rows=JOURNAL_ROWS, drones=DRONES)
    assert comparison.differences == ()
    return comparison.identical and comparison.transitions == JOURNAL_ROWS * DRONES
