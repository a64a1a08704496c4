"""What the holder of a key may request."""

from protocol.messages import Dismiss, Drain, Hello, Register, Role

MAY_CALL: dict[Role, frozenset[Role]] = {
    Role.RENDER: frozenset({Role.PERCEPTION, Role.AGENT, Role.ORCHESTRATOR}),
    Role.PERCEPTION: frozenset({Role.AGENT, Role.ORCHESTRATOR}),
    Role.AGENT: frozenset({Role.ORCHESTRATOR}),
    Role.ORCHESTRATOR: frozenset(Role),
}
"""The roles whose calls each role answers."""

_MAY_DISMISS = frozenset({Role.AGENT, Role.ORCHESTRATOR})


def objection(message: object, sender: Role) -> str | None:
    """Why a message is refused although its sender may call; None if it is allowed."""
    match message:
        case Hello() if message.role is not sender:
            return f"a key of the role {sender} can't say Hello as {message.role}"
        case Register() if message.worker.role is not sender:
            return f"a key of the role {sender} can't register a {message.worker.role} process"
        case Drain() if sender is not Role.ORCHESTRATOR:
            return f"only an orchestrator may drain a worker, not a key of the role {sender}"
        case Dismiss() if sender not in _MAY_DISMISS:
            return f"only an agent or an orchestrator may dismiss workers, not a key of the role {sender}"
        case _:
            return None
