"""What a run was made with: packages, machine and the settings of its processes' environment."""

import importlib.metadata
import os
import platform
import subprocess
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import msgspec
from msgspec import Struct
from packaging.requirements import Requirement

from protocol.messages import PROTOCOL_VERSION
from protocol.text import json_of

DISTRIBUTION = "vantage"


class Versions(Struct, frozen=True, kw_only=True):
    """What a run was made with.

    Attributes:
        made: when that was, in seconds since 1970; 0 of what was made before that was written down.
        environment: what the orchestrator sets for every process of the run, on top of its own.
    """

    made: float = 0.0
    vantage: str
    commit: str | None
    protocol: int
    python: str
    platform: str
    cores: int
    packages: dict[str, str]
    environment: dict[str, str]

    def to_json(self) -> bytes:
        """As a file for people and programs, in a stable order."""
        return msgspec.json.format(json_of(self, stable=True), indent=2) + b"\n"


def collect_versions(environment: Mapping[str, str]) -> Versions:
    """Versions of all that runs here; `environment` is what the run's processes are given."""
    return Versions(
        made=time.time(),
        vantage=installed_version(DISTRIBUTION) or "not installed",
        commit=source_commit(Path(__file__).parent),
        protocol=PROTOCOL_VERSION,
        python=platform.python_version(),
        platform=platform.platform(),
        cores=os.cpu_count() or 1,
        packages={
            requirement.name: version
            for requirement in requirements()
            if (version := installed_version(requirement.name)) is not None
        },
        environment=dict(environment),
    )


def requirements() -> Iterator[Requirement]:
    """What Vantage and its extras ask for, from its own metadata; nothing where it is not installed."""
    try:
        lines = importlib.metadata.requires(DISTRIBUTION) or []
    except importlib.metadata.PackageNotFoundError:
        return
    yield from map(Requirement, lines)


def installed_version(name: str) -> str | None:
    """The version of an installed package, or None."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def source_commit(folder: Path) -> str | None:
    """The commit of the checkout that we run from, with `-dirty` where it was changed; None outside a checkout."""
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        finished = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return finished.stdout.strip()
