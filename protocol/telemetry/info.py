"""What a process is: for people and programs who find it by its port. Nothing in it is secret."""

import os
from importlib.metadata import PackageNotFoundError, version

from msgspec import Struct

from protocol.messages import PROTOCOL_VERSION, Role

PACKAGE = "vantage"


class Info(Struct, frozen=True, kw_only=True):
    """A process, as it tells of itself.

    Attributes:
        name: what the run calls it.
        version: of the package; empty where it is not installed.
        protocol: the newest version of the wire protocol that it speaks.
        incarnation: changes when the process is started again; empty before it has one.
        serves: addresses where it answers requests.
        calls: addresses of the workers that it asks, by their role.
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
    """What is known of a process before it starts."""

    role: Role
    name: str
    serves: tuple[str, ...] = ()
    capabilities: dict[str, str] = {}


def info(about: About, *, incarnation: str, calls: dict[str, tuple[str, ...]]) -> Info:
    """That of the process that this runs in."""
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
