import pytest

from orchestrator.errors import HostLost, ProcessFailed
from orchestrator.monitoring.live_display import Snapshot
from orchestrator.session import Session
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.heartbeat import Health
from orchestrator.supervision.supervisor import Supervisor
from protocol.config import SupervisionConfig
from protocol.errors import DeadlineExceeded, Interrupted
from protocol.messages import Role, WorkerRecord
from protocol.system.stop_request import StopRequest
from protocol.timeouts import Timeouts


def done() -> bool:
    return True


class Recorder:
    """A display that keeps what it was shown, and may ask to stop at something."""

    def __init__(self) -> None:
        self.snapshots: list[Snapshot] = []
        self.on_show = lambda snapshot: None

    def show(self, snapshot: Snapshot) -> None:
        self.snapshots.append(snapshot)
        self.on_show(snapshot)


@pytest.fixture
def display() -> Recorder:
    return Recorder()


@pytest.fixture
def stop() -> StopRequest:
    return StopRequest()


@pytest.fixture
def fleet(tmp_path, stop):
    with Fleet(tmp_path, stop) as fleet:
        yield fleet


@pytest.fixture
def session(fleet, display, stop):
    with Supervisor(fleet, SupervisionConfig(max_restarts=1), Timeouts(startup=30.0)) as supervisor:
        yield Session(fleet, supervisor, display, stop)


def test_workers_are_ready_when_they_say_so(session, fleet, display, worker_launch):
    session.start_workers([worker_launch("serves_nothing", name) for name in ("render-0", "render-1")])
    assert [process.is_running for process in fleet.processes] == [True, True]
    assert display.snapshots[0].activity == "waiting for render-0, render-1"


@pytest.mark.slow
def test_a_worker_that_dies_at_the_start_is_quoted(session, worker_launch):
    with pytest.raises(ProcessFailed, match=r"render-0 ended with exit code 2: bodies-v1.npz is missing"):
        session.start_workers([worker_launch("dies_at_start"), worker_launch("never_gets_ready", "render-1")])


def test_a_request_to_stop_ends_the_wait_for_workers(session, display, stop, worker_launch):
    display.on_show = lambda _: stop.ask()
    with pytest.raises(Interrupted):
        session.start_workers([worker_launch("never_gets_ready")])


@pytest.mark.slow
def test_an_agent_is_waited_for(session, fleet, display, python_launch):
    session.run(python_launch("import time; time.sleep(0.3)", "agent", Role.AGENT), "training", done)
    assert fleet.processes[0].exit_code == 0
    assert {snapshot.activity for snapshot in display.snapshots} == {"training"}
    assert display.snapshots[0].workers[0].state == "running"


def test_an_agent_that_fails_is_quoted(session, python_launch):
    with pytest.raises(ProcessFailed, match="agent ended with exit code 1: ValueError: a NaN action"):
        session.run(python_launch("raise ValueError('a NaN action')", "agent", Role.AGENT), "training", done)


def test_a_request_to_stop_lets_the_agent_finish(session, fleet, display, stop, python_launch, wait_until):
    code = (
        "import signal, sys, time\n"
        "def end(*_): print('weights are written', flush=True); sys.exit(0)\n"
        "signal.signal(signal.SIGTERM, end); print('begun', flush=True); time.sleep(600)"
    )

    def ask(snapshot: Snapshot) -> None:
        wait_until(lambda: fleet.processes[0].last_words() is not None)
        if not stop.is_asked:
            stop.ask()

    display.on_show = ask
    with pytest.raises(Interrupted, match="training was stopped"):
        session.run(python_launch(code, "agent", Role.AGENT), "training", done)
    assert fleet.processes[0].exit_code == 0
    assert fleet.processes[0].last_words() == "weights are written"


class Others:
    """Who works elsewhere: nobody, until a number of looks are over."""

    def __init__(self, absent: int) -> None:
        self.absent = absent
        self.trouble: Exception | None = None

    def waits_for(self) -> str | None:
        self.absent -= 1
        return "a render worker at the host" if self.absent >= 0 else None

    def check(self) -> None:
        if self.trouble is not None:
            raise self.trouble

    def health(self) -> list[Health]:
        return [Health(name="gpu-box", role=Role.RENDER, pid=1, state="starting")]

    def lookup(self, role: Role) -> tuple[WorkerRecord, ...]:
        return ()

    def lacks(self, role: Role) -> bool:
        return False


@pytest.fixture
def joined_session(fleet, display, stop):
    def make(others: Others) -> Session:
        return Session(fleet, supervisor, display, stop, remote_workers=others)

    with Supervisor(fleet, SupervisionConfig(max_restarts=1), Timeouts(startup=30.0)) as supervisor:
        yield make


def test_those_elsewhere_are_waited_for_and_shown(joined_session, display):
    joined_session(Others(absent=3)).wait_for_others(30.0)
    assert display.snapshots[0].activity == "waiting for a render worker at the host"
    assert [one.name for one in display.snapshots[0].workers] == ["gpu-box"]


def test_those_elsewhere_are_not_waited_for_for_ever(joined_session):
    with pytest.raises(DeadlineExceeded, match=r"in vain for a render worker at the host \(gpu-box is starting\)"):
        joined_session(Others(absent=10_000)).wait_for_others(0.1)


def test_a_request_to_stop_ends_the_wait_for_others(joined_session, stop):
    stop.ask()
    with pytest.raises(Interrupted):
        joined_session(Others(absent=10_000)).wait_for_others(30.0)


def test_what_is_lost_elsewhere_ends_the_agent_s_work(joined_session, python_launch):
    others = Others(absent=0)
    others.trouble = HostLost("the host is gone")
    with pytest.raises(HostLost):
        joined_session(others).run(python_launch("import time; time.sleep(600)", "agent", Role.AGENT), "training", done)


def test_the_last_warning_of_any_process_is_shown(session, display, python_launch):
    code = (
        """print('{"level": "warning", "message": "an old filter"}')\n"""
        """print('{"level": "info", "message": "all is well"}')"""
    )
    session.run(python_launch(code, "agent", Role.AGENT), "training", done)
    assert display.snapshots[-1].warning == "agent: an old filter"
