import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from agent.connections import Connections, WorkerAccess
from protocol.config import RunConfig, TimeoutsConfig
from protocol.errors import DeadlineExceeded
from protocol.messages import Lookup, Register, Registered, Role, State, WorkerRecord
from protocol.messages import Workers as Table
from protocol.server.registration_settings import RegistrationSettings
from tests.agent.serving import analytic_workers
from tests.serving import serving

BRIEF = RunConfig(timeouts=TimeoutsConfig(startup=0.3, heartbeat=0.05, liveness=0.1, grace=0.2))
PATIENT = RunConfig(timeouts=TimeoutsConfig(startup=30.0, heartbeat=0.05))


@pytest.fixture
def registered() -> list[WorkerRecord]:
    """Who has told the orchestrator how they are."""
    return []


@pytest.fixture
def orchestrator(tmp_path: Path, registered: list[WorkerRecord]) -> Iterator[RegistrationSettings]:
    """One that knows a render and a perception worker."""
    with analytic_workers(tmp_path) as workers:
        addresses = {Role.RENDER: workers.render, Role.PERCEPTION: workers.perception}

        def register(asked: Register) -> Registered:
            registered.append(asked.worker)
            return Registered()

        def lookup(asked: Lookup) -> Table:
            return Table(
                workers=tuple(
                    WorkerRecord(role=asked.role, address=address, incarnation="x", state=State.READY)
                    for address in addresses[asked.role]
                )
            )

        address = f"ipc://{tmp_path}/orchestrator"
        with serving({Register: register, Lookup: lookup}, address, role=Role.ORCHESTRATOR):
            yield RegistrationSettings(address, "agent")


def test_with_an_orchestrator_no_worker_needs_to_be_named(orchestrator: RegistrationSettings, registered) -> None:
    with Connections(PATIENT, WorkerAccess(registration=orchestrator), lambda: None) as connections:
        connections.wait_ready()
        assert connections.sensor.sample(3, "train") == connections.sensor.sample(3, "train")
        assert connections.statistics().late_replies == 0
    assert {(record.role, record.name, record.address) for record in registered} == {(Role.AGENT, "agent", "")}
    assert len({record.incarnation for record in registered}) == 1


def test_workers_that_nobody_names_are_missed(tmp_path: Path) -> None:
    nobody = RegistrationSettings(f"ipc://{tmp_path}/nobody", "agent")
    with (
        Connections(BRIEF, WorkerAccess(registration=nobody), lambda: None) as connections,
        pytest.raises(DeadlineExceeded),
    ):
        connections.wait_ready()


def test_who_is_left_alone_is_told_so(tmp_path: Path) -> None:
    orphaned = threading.Event()
    with Connections(
        BRIEF, WorkerAccess(registration=RegistrationSettings(f"ipc://{tmp_path}/nobody", "agent")), orphaned.set
    ):
        assert orphaned.wait(30)
