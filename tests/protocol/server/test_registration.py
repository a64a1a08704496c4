"""A process registers, follows the table, and notices when it is alone."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from protocol import Pool, Timeouts
from protocol.errors import AddressUnavailable
from protocol.messages import Role, State, WorkerRecord
from protocol.server.registration import Registration
from tests.protocol.conftest import WORKERS
from tests.protocol.processes.calls import PATIENT, ask, client_of
from tests.protocol.processes.registry import Registry, record
from tests.protocol.processes.serving import serving
from tests.protocol.processes.waiting import wait_until

BRIEF = Timeouts(heartbeat=0.02, liveness=0.1, grace=0.3)
LONG = Timeouts(heartbeat=0.02, liveness=0.2, grace=60.0)


class Process:
    """A process, and what its registration told it."""

    def __init__(self) -> None:
        self.state = State.STARTING
        self.orphaned = threading.Event()
        self.over: list[int] = []

    def describe(self) -> WorkerRecord:
        return record("agent", state=self.state)

    def join(self, orchestrator: str, timeouts: Timeouts = LONG, **options: Any) -> Registration:
        return Registration(
            orchestrator, describe=self.describe, on_orphaned=self.orphaned.set, timeouts=timeouts, **options
        )


@pytest.fixture
def process() -> Process:
    return Process()


@pytest.fixture
def registry(address) -> Iterator[Registry]:
    kept = Registry()
    with serving(address, kept.handlers(), role=Role.ORCHESTRATOR):
        yield kept


def test_a_process_registers_at_once_and_then_with_every_heartbeat(address, registry, process):
    with process.join(address):
        wait_until(lambda: "agent" in registry.table)
        assert registry.table["agent"].state is State.STARTING
        process.state = State.READY
        wait_until(lambda: registry.state("agent") is State.READY)
        beats = registry.beats
        wait_until(lambda: registry.beats > beats + 2)


def test_a_lookup_is_empty_first_and_then_what_the_orchestrator_says(address, registry, process):
    registry.table["render-0"] = record("render-0", "ipc:///render-0", Role.RENDER)
    with process.join(address, Timeouts(heartbeat=600.0)) as registration:
        assert registration.lookup(Role.RENDER) == ()
        wait_until(lambda: registration.lookup(Role.RENDER) == (registry.table["render-0"],))


def test_a_pool_follows_the_table(address, registry, process):
    first, second = f"{address}-1", f"{address}-2"
    with (
        serving(first),
        serving(second),
        Pool([], role=Role.AGENT, serves=Role.RENDER, timeouts=PATIENT) as pool,
        process.join(address) as registration,
    ):
        registration.follow(pool, Role.RENDER)
        registry.table["render-0"] = record("render-0", first, Role.RENDER)
        assert pool.call(ask(1)).scene.yaw == 1
        registry.table["render-1"] = record("render-1", second, Role.RENDER)
        wait_until(lambda: pool.addresses == (first, second))
        del registry.table["render-0"]
        wait_until(lambda: pool.addresses == (second,))
        assert pool.call(ask(2)).scene.yaw == 2


def test_a_pool_keeps_what_it_was_given_and_is_never_emptied(address, registry, process):
    given, told = f"{address}-1", f"{address}-2"
    registry.table["render-1"] = record("render-1", told, Role.RENDER)
    with (
        Pool([given], role=Role.AGENT, serves=Role.RENDER) as pool,
        Pool([], role=Role.AGENT, serves=Role.RENDER) as empty,
        process.join(address) as registration,
    ):
        registration.follow(pool, Role.RENDER)
        registration.follow(empty, Role.RENDER)
        wait_until(lambda: pool.addresses == (given, told) and empty.addresses == (told,))
        registry.table.clear()
        wait_until(lambda: registration.lookup(Role.RENDER) == ())
        beats = registry.beats
        wait_until(lambda: registry.beats > beats + 2)
        assert (pool.addresses, empty.addresses) == ((given, told), (told,))


def test_a_worker_that_is_missing_for_a_moment_stays(address, registry, process):
    """As after a restart of the orchestrator, when some have registered and others not yet."""
    quick, slow = (record(name, f"{address}-{name}", Role.RENDER) for name in ("quick", "slow"))
    registry.table |= {"quick": quick, "slow": slow}
    seen = set()

    class Watched(Pool):
        def remove(self, address):
            seen.add(address)

    with (
        Watched([], role=Role.AGENT, serves=Role.RENDER) as pool,
        process.join(address, Timeouts(heartbeat=0.02)) as registration,
    ):
        registration.follow(pool, Role.RENDER)
        wait_until(lambda: len(pool.addresses) == 2)
        del registry.table["slow"]
        wait_until(lambda: registration.lookup(Role.RENDER) == (quick,))
        registry.table["slow"] = slow
        wait_until(lambda: len(registration.lookup(Role.RENDER)) == 2)
    assert not seen


def test_a_worker_whose_address_is_none_is_passed_over(address, registry, process):
    registry.table["render-0"] = record("render-0", "nowhere", Role.RENDER)
    registry.table["render-1"] = record("render-1", f"{address}-1", Role.RENDER)
    with Pool([], role=Role.AGENT, serves=Role.RENDER) as pool, process.join(address) as registration:
        registration.follow(pool, Role.RENDER)
        wait_until(lambda: pool.addresses == (f"{address}-1",))


def test_an_orchestrator_that_never_comes_leaves_an_orphan(address, process):
    with process.join(address, BRIEF):
        assert process.orphaned.wait(20)


def test_an_orphan_is_told_once(address, process):
    told = []
    registration = Registration(address, describe=process.describe, on_orphaned=lambda: told.append(1), timeouts=BRIEF)
    with registration:
        wait_until(lambda: told)
        registration._thread.join(20)
    assert told == [1]


def test_a_callback_that_fails_or_closes_harms_nothing(address, process):
    called = threading.Event()

    def fail() -> None:
        registration.close()
        called.set()
        raise RuntimeError("no")

    registration = Registration(address, describe=process.describe, on_orphaned=fail, timeouts=BRIEF)
    assert called.wait(20)
    registration.close()


def test_a_worker_at_the_address_is_not_taken_for_an_orchestrator(address, process):
    with serving(address), process.join(address, BRIEF):
        assert process.orphaned.wait(20)


def test_a_process_that_can_not_describe_itself_still_becomes_an_orphan(address, registry, process):
    described = threading.Event()

    def describe() -> WorkerRecord:
        if described.is_set():
            raise OSError("no")
        described.set()
        return process.describe()

    with Registration(address, describe=describe, on_orphaned=process.orphaned.set, timeouts=BRIEF):
        assert process.orphaned.wait(20)


def test_a_process_that_stood_still_itself_is_no_orphan(address, registry, process):
    """Its clock has run on while it was stopped; the orchestrator is there, and one more beat shows it."""
    jump = [0.0]
    timeouts = Timeouts(heartbeat=0.02, grace=30.0)
    with process.join(address, timeouts, clock=lambda: jump[0]):
        wait_until(lambda: registry.beats > 2)
        jump[0] = 1000.0
        beats = registry.beats
        wait_until(lambda: registry.beats > beats + 5)
    assert not process.orphaned.is_set()


def test_the_end_of_the_run_is_told_once_and_the_process_stays_registered_and_is_no_orphan(address, registry, process):
    with process.join(address, BRIEF, on_over=lambda: process.over.append(1)):
        wait_until(lambda: registry.beats > 2)
        assert not process.over
        registry.over = True
        wait_until(lambda: process.over)
        beats = registry.beats
        wait_until(lambda: registry.beats > beats + 5)
    assert process.over == [1]


def test_a_process_that_was_told_to_end_does_not_miss_the_orchestrator(address, process, caplog):
    kept = Registry()
    kept.over = True
    with process.join(address, BRIEF, on_over=lambda: process.over.append(1)) as registration:
        with serving(address, kept.handlers(), role=Role.ORCHESTRATOR):
            wait_until(lambda: process.over)
        wait_until(lambda: registration.contact.silence > BRIEF.grace)
    assert not process.orphaned.is_set()
    assert "continuing without" not in caplog.text


def test_without_a_callback_the_end_of_the_run_is_ignored(address, registry, process, caplog):
    caplog.set_level("INFO", logger="protocol.server.registration")
    registry.over = True
    with process.join(address):
        wait_until(lambda: registry.beats > 3)
    assert "the run is over" not in caplog.text


def test_the_contact_tells_whether_the_orchestrator_was_ever_there_and_since_when_it_is_not(address, process):
    kept = Registry()
    with process.join(address, Timeouts(heartbeat=0.02, liveness=0.1, grace=60.0)) as registration:
        wait_until(lambda: registration.contact.trouble is not None)
        assert not registration.contact.ever
        with serving(address, kept.handlers(), role=Role.ORCHESTRATOR):
            wait_until(lambda: registration.contact.ever)
            assert (registration.contact.silence, registration.contact.trouble) == (0.0, None)
        wait_until(lambda: registration.contact.silence > 0.1)
        assert registration.contact.ever


def test_what_is_no_address_is_refused(process):
    with pytest.raises(AddressUnavailable):
        process.join("nowhere")


@pytest.mark.slow
class TestOrchestratorInTrouble:
    @pytest.fixture
    def orchestrate(self, address, start) -> Callable[[], subprocess.Popen[bytes]]:
        def orchestrate() -> subprocess.Popen[bytes]:
            orchestrator = start("keeps_a_registry", address)
            with client_of(address) as client:
                client.wait_ready()
            return orchestrator

        return orchestrate

    @pytest.fixture
    def said_last(self, caplog) -> Callable[[str], bool]:
        """Whether the registration's last message has these words: it may say more of them than a test counts."""
        caplog.set_level("INFO", logger="protocol.server.registration")

        def said_last(words: str) -> bool:
            said = [record.getMessage() for record in caplog.records if record.name == "protocol.server.registration"]
            return bool(said) and words in said[-1]

        return said_last

    def test_one_that_comes_late_is_found(self, address, orchestrate, process):
        with process.join(address) as registration:
            orchestrate()
            registration.lookup(Role.AGENT)
            wait_until(lambda: registration.lookup(Role.AGENT))

    def test_one_that_is_killed_and_started_again_takes_the_process_back(
        self, address, orchestrate, process, said_last
    ):
        orchestrator = orchestrate()
        with process.join(address) as registration:
            wait_until(lambda: registration.lookup(Role.AGENT))
            for _ in range(2):
                orchestrator.kill()
                orchestrator.wait()
                wait_until(lambda: said_last("continuing without the orchestrator"))
                orchestrator = orchestrate()
                wait_until(lambda: said_last("answers again"))
        assert not process.orphaned.is_set()

    def test_one_that_is_stopped_for_a_while_is_missed_and_found_again(self, address, orchestrate, process, said_last):
        orchestrator = orchestrate()
        with process.join(address) as registration:
            wait_until(lambda: registration.lookup(Role.AGENT))
            orchestrator.send_signal(signal.SIGSTOP)
            wait_until(lambda: said_last("continuing without the orchestrator"))
            orchestrator.send_signal(signal.SIGCONT)
            wait_until(lambda: said_last("answers again"))
        assert not process.orphaned.is_set()

    @pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGSTOP])
    def test_one_that_never_comes_back_leaves_an_orphan(self, address, orchestrate, process, blow):
        orchestrator = orchestrate()
        with process.join(address, Timeouts(heartbeat=0.02, liveness=0.1, grace=1.0)) as registration:
            wait_until(lambda: registration.lookup(Role.AGENT))
            orchestrator.send_signal(blow)
            assert process.orphaned.wait(20)

    def test_a_process_that_forgets_to_close_its_registration_still_ends(self, address):
        forgets = [sys.executable, WORKERS / "forgets_to_unregister.py", address]
        assert subprocess.run(forgets, timeout=20, check=False, env=dict(os.environ)).returncode == 0
