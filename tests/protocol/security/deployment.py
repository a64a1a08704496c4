"""A deployment of several machines, as far as keys are concerned: a folder with a key for each process."""

import shutil
import socket
import threading
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from protocol import Client, Pool, Timeouts, serve
from protocol.messages import Drain, Role
from protocol.security import Security, load_credentials, new_key_pair, read_key, write_key
from protocol.security.allow_list import AllowList, read_allow_list, write_allow_list
from tests.protocol.processes.calls import PATIENT
from tests.protocol.processes.serving import SCENES


class Deployment:
    """Keys in a folder, by name; `render` is the key of the role, unless told otherwise."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.allowed = folder / "allowed.json"
        write_allow_list(AllowList(), self.allowed)
        for role in Role:
            self.make(role.value, role)

    def copy_to(self, folder: Path, names: Iterable[str]) -> None:
        """Copy the list as it is now, and the keys of these names."""
        folder.mkdir(parents=True)
        for file in (self.allowed, *(self.folder / f"{name}.key" for name in names)):
            shutil.copy(file, folder)

    def make(self, name: str, role: Role, *, allow: bool = True) -> Path:
        """A key's file."""
        key, path = new_key_pair(name, role), self.folder / f"{name}.key"
        write_key(key, path)
        if allow:
            write_allow_list(read_allow_list(self.allowed).with_key(key), self.allowed)
        return path

    def revoke(self, name: str) -> None:
        write_allow_list(read_allow_list(self.allowed).without(name), self.allowed)

    def public(self, name: str) -> str:
        return read_key(self.folder / f"{name}.key").public

    def security(self, name: str) -> Security:
        return Security(load_credentials(self.folder / f"{name}.key"))

    def make_up(self, name: str, role: Role, folder: Path) -> Path:
        """Write a key that is not allowed, beside a list that its owner made, with all allowed keys in it."""
        key, path = new_key_pair(name, role), folder / f"{name}.key"
        write_key(key, path)
        write_allow_list(read_allow_list(self.allowed).with_key(key), folder / "allowed.json")
        return path

    def stranger(self, role: Role) -> Security:
        """A stranger who knows all public keys, and whose own key is not allowed."""
        return Security(load_credentials(self.make_up("stranger", role, self.folder / "elsewhere")))

    @contextmanager
    def serving(self, handlers: Any = SCENES, *, role: Role = Role.RENDER, key: str = "", **options) -> Generator[str]:
        """A worker with its key in a thread; gives its address, and drains at the end."""
        address = f"tcp://127.0.0.1:{free_port()}"
        security = self.security(key or role.value)
        arguments = {"role": role, "bind": address, "security": security, **options}
        thread = threading.Thread(target=serve, args=(lambda: handlers,), kwargs=arguments, daemon=True)
        thread.start()
        orchestrator = self.security("orchestrator")
        with Pool([], role=Role.ORCHESTRATOR, serves=role, timeouts=PATIENT, security=orchestrator) as pool:
            pool.add(address, self.public(key or role.value))
            pool.ping()
            try:
                yield address
            finally:
                pool.call(Drain())
                thread.join()

    def client(self, address: str, role: Role, security: Security | None = None, **options: Any) -> Client:
        options = {"serves": Role.RENDER, "timeouts": PATIENT, **options}
        return Client(address, role=role, security=security or self.security(role.value), **options)


def free_port() -> int:
    """A port that was free a moment ago."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return probe.getsockname()[1]


HASTY = Timeouts(call=1.0, startup=1.0, heartbeat=0.05)
