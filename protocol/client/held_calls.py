"""The calls that a worker holds: sent to it, and not yet answered."""

from protocol.client.call import Call


class HeldCalls:
    """Calls in the order in which they were sent, each under the request id of its last try."""

    def __init__(self) -> None:
        self._calls: dict[int, Call] = {}

    def __len__(self) -> int:
        return len(self._calls)

    def __contains__(self, call: Call) -> bool:
        return any(held is call for held in self._calls.values())

    def add(self, request_id: int, call: Call) -> None:
        """The call was sent under this id."""
        self._calls[request_id] = call

    def answered(self, request_id: int) -> Call | None:
        """Remove the call that a reply with this id belongs to; None if there is none."""
        return self._calls.pop(request_id, None)

    @property
    def need_a_handler(self) -> bool:
        """Whether one of the calls has to be answered by a handler, and not by the worker's I/O thread."""
        return any(not call.at_once for call in self._calls.values())

    def take_all(self) -> list[Call]:
        """Remove all calls."""
        taken = list(self._calls.values())
        self._calls.clear()
        return taken

    def take_movable(self) -> list[Call]:
        """Remove the calls that another worker may answer: those that need a handler."""
        taken = {number: call for number, call in self._calls.items() if not call.at_once}
        for number in taken:
            del self._calls[number]
        return list(taken.values())

    def forget(self, call: Call) -> None:
        """Remove the call, if the worker holds it."""
        for number, held in self._calls.items():
            if held is call:
                del self._calls[number]
                return
