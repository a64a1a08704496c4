"""Several hosts on one machine: network namespaces on one switch, none of which sees the machine's own network."""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

NETWORK = "10.83.0"


def why_not() -> str | None:
    """Why there can be no such hosts here; None if there can."""
    if sys.platform != "linux" or os.geteuid() != 0:
        return "network namespaces need Linux and root"
    if shutil.which("ip") is None:
        return "network namespaces need the command ip (Debian: apt-get install iproute2)"
    tried = subprocess.run(["ip", "netns", "add", "vantage-probe"], capture_output=True, text=True)
    subprocess.run(["ip", "netns", "del", "vantage-probe"], capture_output=True)
    return None if tried.returncode == 0 else f"no network namespaces here: {tried.stderr.strip()}"


class Hosts:
    """Hosts by name, each with an address; `close` ends their processes and removes them.

    Whoever makes some takes away those that are left of the same `network`: two at the same time need two names.
    """

    def __init__(self, names: Sequence[str], network: str = "vantage") -> None:
        self._network = network
        self._switch = f"{network}-switch"
        self.addresses = {name: f"{NETWORK}.{number}" for number, name in enumerate(names, start=1)}
        self._processes: list[subprocess.Popen[str]] = []
        self._remove()
        _ip("netns", "add", self._switch)
        _ip("-n", self._switch, "link", "add", "switch", "type", "bridge")
        _ip("-n", self._switch, "link", "set", "switch", "up")
        for name in names:
            self._plug_in(name)

    def start(self, host: str, *command: str, log: Path, environment: Mapping[str, str]) -> subprocess.Popen[str]:
        """Start a program on a host; what it says goes to `log`."""
        with log.open("w") as file:
            process = subprocess.Popen(
                self._on(host, command), env={**os.environ, **environment}, stdout=file, stderr=file, text=True
            )
        self._processes.append(process)
        return process

    def run(self, host: str, *command: str) -> str:
        """Run a program on a host to its end; returns what it printed."""
        done = subprocess.run(self._on(host, command), capture_output=True, text=True, timeout=240)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def close(self) -> None:
        for process in reversed(self._processes):
            process.terminate()
        for process in self._processes:
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._remove()

    def _on(self, host: str, command: Sequence[str]) -> list[str]:
        return ["ip", "netns", "exec", self._namespace(host), *command]

    def _namespace(self, host: str) -> str:
        return f"{self._network}-{host}"

    def _plug_in(self, name: str) -> None:
        host = self._namespace(name)
        _ip("netns", "add", host)
        _ip("-n", self._switch, "link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", host)
        _ip("-n", self._switch, "link", "set", name, "master", "switch", "up")
        _ip("-n", host, "addr", "add", f"{self.addresses[name]}/24", "dev", "eth0")
        for device in ("lo", "eth0"):
            _ip("-n", host, "link", "set", device, "up")

    def _remove(self) -> None:
        """Remove them, also those that a killed test has left."""
        for name in (*map(self._namespace, self.addresses), self._switch):
            subprocess.run(["ip", "netns", "del", name], capture_output=True)


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True)
