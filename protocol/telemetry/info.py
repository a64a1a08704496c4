"""Information about a process, for people and programs that find its port. Nothing in it is secret."""

import os
from importlib.metadata import PackageNotFoundError, version

from msgspec import Struct

from protocol.messages import PROTOCOL_VERSION, Role

PACKAGE = "vantage"


class Info(Struct, frozen=True, kw_only=True):
    """A process's description of itself.

    Attributes:
        name: what the run calls it.
        version: of the package; empty if it is not installed.
        protocol: the newest version of the wire protocol that it speaks.
        incarnation: changes when the process is restarted; empty until it has one.
        serves: the addresses at which it answers requests.
        calls: the addresses of the workers that it calls, by role.
        capabilities: what it computes with, such as its network or renderer.
    """

    role: Role
    name: str
    version: str
    protocol: int
    incarnation: str
    serves: tuple[str, ...]
    calls: dict[str, tuple[str, ...]]
    pid: int
    capabilities: dict[str, str]


class About(Struct, frozen=True, kw_only=True):
    """What is known about a process before it starts."""

    role: Role
    name: str
    serves: tuple[str, ...] = ()
    capabilities: dict[str, str] = {}


def info(about: About, *, incarnation: str, calls: dict[str, tuple[str, ...]]) -> Info:
    """The description of this process."""
    return Info(
        role=about.role,
        name=about.name,
        version=_installed_version(),
        protocol=PROTOCOL_VERSION,
        incarnation=incarnation,
        serves=about.serves,
        calls=calls,
        pid=os.getpid(),
        capabilities=about.capabilities,
    )


def _installed_version() -> str:
    try:
        return version(PACKAGE)
    except PackageNotFoundError:
        return ""
