import os
import signal
import sys
import time
from collections import Counter
from contextlib import ExitStack
from itertools import count
from pathlib import Path

import psutil
import pytest

from orchestrator.errors import ProcessFailed, RestartsExhausted
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.launch import Launch
from orchestrator.supervision.orphans import Orphans
from orchestrator.supervision.supervisor import Supervisor
from orchestrator.supervision.worker_process import WorkerProcess
from protocol.client.client import Client
from protocol.config import SupervisionConfig
from protocol.errors import DeadlineExceeded
from protocol.messages import Role, SampleScene
from protocol.system.stop_request import StopRequest
from protocol.timeouts import Timeouts

FAST = Timeouts(heartbeat=0.1, startup=60.0, liveness=15.0, progress=30.0)
IMPATIENT = Timeouts(heartbeat=0.1, startup=60.0, liveness=1.0, progress=30.0)
"""For what is to be found silent; on a busy machine others may be taken for it as well."""
PATIENCE = 30.0


class Supervised:
    """A supervisor with a fleet, and what it noted."""

    def __init__(self, folder, stack: ExitStack, config: SupervisionConfig, timeouts: Timeouts, orphans) -> None:
        self.noted = []
        self.fleet = stack.enter_context(Fleet(folder, StopRequest()))
        self.supervisor = stack.enter_context(
            Supervisor(self.fleet, config, timeouts, orphans=orphans, on_restart=self.noted.append)
        )

    def poll_until(self, condition) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, "what was waited for did not happen"
            self.supervisor.poll()
            time.sleep(0.02)

    def start_ready(self, launch: Launch) -> WorkerProcess:
        process = self.supervisor.start(launch)
        self.poll_until(lambda: self.supervisor.is_ready(launch.name))
        return process

    def poll_until_replaced(self, process: WorkerProcess) -> WorkerProcess:
        self.poll_until(lambda: self.current(process).pid != process.pid and self.supervisor.is_ready(process.name))
        return self.current(process)

    def current(self, process: WorkerProcess) -> WorkerProcess:
        return next(other for other in self.fleet.processes if other.name == process.name)


@pytest.fixture
def supervise(tmp_path):
    with ExitStack() as stack:

        def make(timeouts: Timeouts = FAST, orphans: Orphans | None = None, **config) -> Supervised:
            return Supervised(tmp_path, stack, SupervisionConfig(**config), timeouts, orphans)

        yield make


@pytest.fixture
def launch(worker_launch):
    def make(program: str, *arguments: str, name: str = "render-0") -> Launch:
        plain = worker_launch(program, name)
        return Launch(name=name, role=plain.role, command=(*plain.command, *arguments), address=plain.address)

    return make


def asking(launch: Launch) -> Client:
    return Client(str(launch.address), role=Role.AGENT, timeouts=FAST)


@pytest.mark.slow
def test_a_killed_worker_is_started_again_at_its_address(supervise, launch):
    supervised = supervise()
    first = supervised.start_ready(launch("serves_nothing"))
    os.kill(first.pid, signal.SIGKILL)
    second = supervised.poll_until_replaced(first)
    assert not psutil.pid_exists(first.pid)
    assert (second.launch, second.is_running) == (first.launch, True)
    assert [(restart.process, restart.planned) for restart in supervised.noted] == [("render-0", False)]
    assert "was killed by SIGKILL" in supervised.noted[0].reason
    assert [health.restarts for health in supervised.supervisor.health()] == [1]


def test_the_first_look_after_a_death_starts_the_successor(supervise, launch):
    supervised = supervise()
    first = supervised.start_ready(launch("serves_nothing"))
    first.kill()
    assert first.wait(PATIENCE)
    supervised.supervisor.poll()
    assert supervised.current(first).pid != first.pid


@pytest.mark.slow
def test_a_stopped_worker_is_killed_and_replaced(supervise, launch):
    supervised = supervise(IMPATIENT)
    first = supervised.start_ready(launch("serves_nothing"))
    os.kill(first.pid, signal.SIGSTOP)
    supervised.poll_until_replaced(first)
    assert first.exit_code == -signal.SIGKILL
    assert "render-0 hung (silent for 1 s) and was killed" in supervised.noted[0].reason


@pytest.mark.slow
def test_an_agent_that_was_stopped_before_it_was_ever_heard_of_is_killed_and_replaced(supervise, tmp_path):
    supervised = supervise(IMPATIENT)
    first = supervised.supervisor.start(agent("import time; time.sleep(600)"), lambda: False)
    os.kill(first.pid, signal.SIGSTOP)
    supervised.poll_until(lambda: supervised.noted)
    assert first.exit_code == -signal.SIGKILL
    assert supervised.current(first).is_running


@pytest.mark.slow
def test_a_worker_in_an_endless_handler_is_killed_and_replaced_though_it_answers_pings(supervise, launch):
    supervised = supervise(Timeouts(heartbeat=0.1, startup=30.0, liveness=20.0, progress=0.5))
    hangs = launch("hangs_in_a_handler")
    first = supervised.start_ready(hangs)
    with asking(hangs) as client:
        pending = client.submit(SampleScene(seed=1, split="train"))
        supervised.poll_until(lambda: supervised.noted)
        pending.cancel()
    assert first.exit_code == -signal.SIGKILL
    assert "made no progress for 0.5 s with requests in hand" in supervised.noted[0].reason


@pytest.mark.slow
def test_a_slow_worker_is_left_alone(supervise, launch):
    supervised = supervise(Timeouts(heartbeat=0.1, startup=30.0, liveness=20.0, progress=3.0))
    slow = launch("samples", "0.5")
    first = supervised.start_ready(slow)
    with asking(slow) as client:
        answers = [client.submit(SampleScene(seed=seed, split="train")) for seed in range(8)]
        supervised.poll_until(lambda: all(answer.done() for answer in answers))
    assert supervised.current(first).pid == first.pid
    assert supervised.noted == []


@pytest.mark.slow
def test_a_worker_that_ends_by_itself_is_started_again(supervise, launch):
    supervised = supervise()
    first = supervised.start_ready(launch("serves_nothing"))
    first.ask_to_stop()
    supervised.poll_until_replaced(first)
    assert "ended with exit code 0" in supervised.noted[0].reason


def test_a_worker_that_can_never_work_is_not_started_again(supervise, launch):
    supervised = supervise()
    supervised.supervisor.start(launch("dies_at_start"))
    with pytest.raises(ProcessFailed, match=r"render-0 ended with exit code 2: bodies-v1.npz is missing"):
        supervised.poll_until(lambda: False)
    assert supervised.noted == []


def test_a_spent_budget_ends_everything_with_the_reason_and_the_last_words(supervise, python_launch):
    supervised = supervise(max_restarts=2, window=60.0, initial_backoff=0.1)
    supervised.supervisor.start(python_launch("print('out of paint'); raise SystemExit(3)", address="ipc:///tmp/none"))
    said = r"render-0 ended with exit code 3: out of paint .*; it was restarted 2 times within 60 s already"
    with pytest.raises(RestartsExhausted, match=said):
        supervised.poll_until(lambda: False)
    assert len(supervised.noted) == 2


@pytest.mark.slow
def test_a_worker_that_never_gets_ready_runs_out_of_the_startup_clock(supervise, launch):
    supervised = supervise(Timeouts(heartbeat=0.1, startup=4.0))
    supervised.supervisor.start(launch("never_gets_ready"))
    with pytest.raises(
        DeadlineExceeded, match=r"render-0 did not get ready within 4 s; .*the last line of its log: .*render-0.jsonl"
    ):
        supervised.poll_until(lambda: False)


@pytest.mark.slow
def test_a_worker_is_replaced_after_so_many_requests_and_no_request_is_lost(supervise, launch):
    supervised = supervise(recycle_requests=5, max_restarts=1)
    samples = launch("samples")
    supervised.start_ready(samples)
    with asking(samples) as client:
        seeds = range(12)
        answers = [client.submit(SampleScene(seed=seed, split="train")) for seed in seeds]
        supervised.poll_until(lambda: all(answer.done() for answer in answers))
        assert [answer.result().scene.pose.kind for answer in answers] == [seed % 8 for seed in seeds]
        supervised.poll_until(lambda: supervised.noted and supervised.supervisor.is_ready("render-0"))
    assert all(restart.planned for restart in supervised.noted)
    assert "requests and is replaced" in supervised.noted[0].reason
    assert [health.restarts for health in supervised.supervisor.health()] == [0]


@pytest.mark.slow
def test_a_worker_is_replaced_once_it_takes_too_much_memory_but_not_before_it_worked(supervise, launch):
    supervised = supervise(recycle_bytes=1, max_restarts=1)
    samples = launch("samples")
    first = supervised.start_ready(samples)
    for _ in range(20):
        supervised.supervisor.poll()
        time.sleep(0.02)
    assert supervised.noted == []
    with asking(samples) as client:
        client.call(SampleScene(seed=1, split="train"))
    supervised.poll_until_replaced(first)
    assert "takes" in supervised.noted[0].reason
    assert first.exit_code == 0


@pytest.mark.slow
def test_workers_are_replaced_one_after_the_other(supervise, launch):
    supervised = supervise(recycle_requests=1)
    workers = [launch("samples", name=name) for name in ("render-0", "render-1")]
    for worker in workers:
        supervised.start_ready(worker)
    with asking(workers[0]) as first, asking(workers[1]) as second:
        for client in (first, second):
            client.call(SampleScene(seed=1, split="train"))
    states = Counter()

    def look() -> bool:
        states[tuple(supervised.supervisor.is_ready(worker.name) for worker in workers)] += 1
        return len(supervised.noted) == 2

    supervised.poll_until(look)
    assert states[False, False] == 0


def agent(code: str) -> Launch:
    return Launch(name="agent", role=Role.AGENT, command=(sys.executable, "-c", code))


def test_an_agent_is_started_again_until_its_work_is_done(supervise, tmp_path):
    done = tmp_path / "done"
    supervised = supervise()
    code = f"import pathlib, os; p = pathlib.Path({str(done)!r}); p.touch() if p.with_name('once').exists() else None; "
    code += "p.with_name('once').touch(); os.kill(os.getpid(), 9) if not p.exists() else None"
    supervised.supervisor.start(agent(code), lambda: done.exists())
    supervised.poll_until(lambda: supervised.supervisor.is_over("agent"))
    assert [restart.process for restart in supervised.noted] == ["agent"]


def test_an_agent_that_ends_in_peace_before_its_work_is_done_is_started_again(supervise, tmp_path):
    supervised = supervise(max_restarts=1)
    supervised.supervisor.start(agent("pass"), lambda: False)
    with pytest.raises(RestartsExhausted, match="agent ended with exit code 0 without a word"):
        supervised.poll_until(lambda: False)


def test_an_agent_that_fails_after_its_work_was_written_is_started_again(supervise):
    supervised = supervise(max_restarts=1)
    supervised.supervisor.start(agent("raise SystemExit(3)"), lambda: True)
    supervised.poll_until(lambda: supervised.noted)
    assert not supervised.supervisor.is_over("agent")


@pytest.mark.slow
def test_an_agent_that_hangs_after_its_work_was_written_is_killed_and_over(supervise, tmp_path, wait_until):
    done = tmp_path / "done"
    supervised = supervise(IMPATIENT)
    code = f"import pathlib, time; pathlib.Path({str(done)!r}).touch(); time.sleep(600)"
    first = supervised.supervisor.start(agent(code), lambda: done.exists())
    wait_until(done.exists)
    os.kill(first.pid, signal.SIGSTOP)
    supervised.poll_until(lambda: supervised.supervisor.is_over("agent"))
    assert first.exit_code == -signal.SIGKILL
    assert supervised.noted == []


@pytest.mark.slow
def test_an_orphan_is_adopted_and_supervised(supervise, launch, tmp_path):
    wanted = launch("serves_nothing")
    earlier = WorkerProcess.start(wanted, tmp_path / "render-0.jsonl", {})
    supervised = supervise(orphans=Orphans((), [wanted], {"render-0"}))
    taken = supervised.start_ready(wanted)
    assert taken.pid == earlier.pid
    os.kill(earlier.pid, signal.SIGKILL)
    assert earlier.wait(PATIENCE)
    supervised.poll_until_replaced(taken)
    assert "render-0 has ended" in supervised.noted[0].reason


@pytest.mark.slow
def test_a_stopped_orphan_is_detected(supervise, launch, tmp_path, wait_until):
    wanted = launch("serves_nothing")
    earlier = WorkerProcess.start(wanted, tmp_path / "render-0.jsonl", {})
    wait_until(lambda: Path(str(wanted.address).removeprefix("ipc://")).exists())
    os.kill(earlier.pid, signal.SIGSTOP)
    supervised = supervise(IMPATIENT, Orphans((), [wanted], {"render-0"}))
    taken = supervised.supervisor.start(wanted)
    supervised.poll_until_replaced(taken)
    assert earlier.exit_code == -signal.SIGKILL


def test_an_adopted_agent_is_done_when_its_work_is_there(supervise, tmp_path):
    done = tmp_path / "done"
    working = agent(f"import pathlib, time\nwhile not pathlib.Path({str(done)!r}).exists(): time.sleep(0.02)")
    earlier = WorkerProcess.start(working, tmp_path / "agent.jsonl", {})
    supervised = supervise(orphans=Orphans((), [working], {"agent"}))
    assert supervised.supervisor.start(working, lambda: done.exists()).pid == earlier.pid
    done.touch()
    assert earlier.wait(PATIENCE)
    supervised.poll_until(lambda: supervised.supervisor.is_over("agent"))
    assert supervised.noted == []


def test_an_agent_whose_workers_elsewhere_are_gone_is_not_taken_for_one_that_never_begins(tmp_path):
    seconds, noted, absent = count(), [], {Role.RENDER}
    with (
        Fleet(tmp_path, StopRequest()) as fleet,
        Supervisor(
            fleet,
            SupervisionConfig(),
            Timeouts(startup=5.0, liveness=1.0),
            on_restart=noted.append,
            lacks=lambda role: role in absent,
            clock=lambda: float(next(seconds)),
        ) as supervisor,
    ):
        agent_process = supervisor.start(agent("import time; time.sleep(600)"), lambda: False)
        for _ in range(50):
            supervisor.poll()
        assert (agent_process.is_running, noted) == (True, [])
        absent.clear()
        for _ in range(50):
            supervisor.poll()
        assert agent_process.wait(PATIENCE)
