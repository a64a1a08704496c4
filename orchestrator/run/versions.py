"""What a run was made with: versions of packages, the machine, and its processes' environment."""

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
        made: when, in seconds since 1970; 0 in records of versions that did not write it.
        environment: the variables that the orchestrator sets for every process of the run, besides its own.
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
        """As indented JSON, in a stable order."""
        return msgspec.json.format(json_of(self, stable=True), indent=2) + b"\n"


def collect_versions(environment: Mapping[str, str]) -> Versions:
    """The versions of all that runs here; `environment` has the variables set for the run's processes."""
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
    """The requirements of Vantage and its extras, from its metadata; none where it is not installed."""
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
    """The commit of the checkout that we run from, with `-dirty` if it has changes; None outside a checkout."""
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        finished = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return finished.stdout.strip()
