"""A stand-in for the orchestrator: it writes down who registers, and tells it to who asks."""

from protocol import Handlers
from protocol.messages import Lookup, Register, Registered, Role, State, WorkerRecord, Workers


class Registry:
    """Handlers with a table; rows of the table by name."""

    def __init__(self) -> None:
        self.table: dict[str, WorkerRecord] = {}
        self.beats = 0
        self.over = False

    def handlers(self) -> Handlers:
        """What an orchestrator answers."""
        return {Register: self.register, Lookup: self.lookup}

    def state(self, name: str) -> State | None:
        """The state of a process by its last heartbeat; None before the first."""
        return self.table[name].state if name in self.table else None

    def register(self, request: Register) -> Registered:
        """Enter a process."""
        self.beats += 1
        self.table[request.worker.name] = request.worker
        return Registered(over=self.over)

    def lookup(self, request: Lookup) -> Workers:
        """Tell of a role."""
        return Workers(workers=tuple(one for one in self.table.values() if one.role is request.role))


def record(name: str, address: str = "", role: Role = Role.AGENT, state: State = State.READY) -> WorkerRecord:
    """A row of the table."""
    return WorkerRecord(role=role, address=address, incarnation="x", state=state, name=name)
