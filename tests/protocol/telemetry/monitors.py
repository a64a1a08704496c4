"""A monitor that queries a process over real HTTP."""

import re
import socket
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

import httpx

from protocol.telemetry.endpoint import Endpoint


class Monitor:
    """Asks one process."""

    def __init__(self, at: Endpoint) -> None:
        self._client = httpx.Client(base_url=f"http://{at}", timeout=20.0, trust_env=False)

    def get(self, path: str) -> httpx.Response:
        """The response, with any status."""
        return self._client.get(path)

    def post(self, path: str, **headers: str) -> httpx.Response:
        """The response to a control call, with any status."""
        return self._client.post(path, headers=headers)

    def json(self, path: str) -> Any:
        """The decoded body, with any status."""
        return self.get(path).json()

    def is_ready(self) -> bool:
        """Whether the process says so; False while it does not answer."""
        try:
            return self.get("/health/ready").status_code == 200
        except httpx.TransportError:
            return False

    def answers(self) -> bool:
        """Whether the process answers."""
        try:
            self.get("/info")
        except httpx.TransportError:
            return False
        return True

    def waits_on(self) -> set[str]:
        """On whom or what."""
        return {wait["on"] for wait in self.json("/health/ready")["waits_for"]}

    def metric(self, name: str, **labels: str) -> float | None:
        """The value of a sample; None where there is none."""
        for line in self.get("/metrics").text.splitlines():
            found = re.fullmatch(r"(\w+)(?:\{(.*)\})? (\S+)", line)
            if found and found[1] == name and dict(re.findall(r'(\w+)="([^"]*)"', found[2] or "")) == labels:
                return float(found[3])
        return None

    def close(self) -> None:
        """Let go."""
        self._client.close()


@contextmanager
def monitoring(at: Endpoint) -> Iterator[Monitor]:
    """A monitor for as long as a `with` lasts."""
    with closing(Monitor(at)) as monitor:
        yield monitor


def free_endpoint() -> Endpoint:
    """An endpoint at which no process listens now."""
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return Endpoint("127.0.0.1", probe.getsockname()[1])
