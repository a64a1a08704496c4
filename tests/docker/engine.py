"""A Docker engine of its own for the tests, which a script brings up and takes down; no other engine is touched."""

import os
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
SCRIPT_VARIABLE = "VANTAGE_DOCKER_LAB"
"""Names the script, where it is not beside the repository."""

_NO_SCRIPT = f"there is no engine for tests: {{}} is missing; {SCRIPT_VARIABLE} may name it"


class NoEngine(Exception):
    """There can be no engine here; the message says why."""


class Engine:
    """An engine that `script` has installed. `build` has the machine's network, `private` one of its own, closed."""

    def __init__(self, script: Path, environment: Mapping[str, str]) -> None:
        self._script = script
        self.environment = dict(environment)

    @classmethod
    def install(cls) -> "Engine":
        """Install an engine.

        Raises:
            NoEngine: it can't be had on this machine.
        """
        script = Path(os.environ.get(SCRIPT_VARIABLE, REPOSITORY.parent / "shared" / "tools" / "docker-lab.sh"))
        if not script.is_file():
            raise NoEngine(_NO_SCRIPT.format(script))
        if sys.platform != "linux" or os.geteuid() != 0:
            raise NoEngine("an engine for tests needs Linux and root")
        for order in ("install", "base"):
            done = subprocess.run(["bash", script, order], capture_output=True, text=True, timeout=600)
            if done.returncode != 0:
                raise NoEngine(f"{script.name} {order} failed: {(done.stderr.strip().splitlines() or ['no word'])[-1]}")
        shown = f'eval "$(bash {shlex.quote(str(script))} env)" && env --null'
        done = subprocess.run(["bash", "-c", shown], capture_output=True, text=True, check=True)
        return cls(script, dict(line.split("=", 1) for line in done.stdout.split("\0") if "=" in line))

    def up(self, mode: str) -> None:
        """Have it run in a mode."""
        subprocess.run(["bash", self._script, "up", mode], check=True, capture_output=True, timeout=120)

    def down(self) -> None:
        """End it and all its containers."""
        subprocess.run(["bash", self._script, "down"], check=True, capture_output=True, timeout=120)

    def beside(self, *command: str) -> None:
        """Run one of this machine's programs in the engine's own network."""
        done = subprocess.run(["bash", self._script, "exec", *command], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr

    def run(
        self, *words: str, environment: Mapping[str, str] | None = None, timeout: float = 120
    ) -> subprocess.CompletedProcess[str]:
        """Run `docker WORDS`, whatever comes of it."""
        return subprocess.run(
            ["docker", *words],
            env={**self.environment, **(environment or {})},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=timeout,
        )

    def docker(self, *words: str, environment: Mapping[str, str] | None = None, timeout: float = 120) -> str:
        """Run `docker WORDS`, and return what it says."""
        done = self.run(*words, environment=environment, timeout=timeout)
        assert done.returncode == 0, f"docker {shlex.join(words)}: {done.stdout}"
        return done.stdout.strip()

    def inspect(self, thing: str, template: str) -> str:
        """What `docker inspect` says of a thing."""
        return self.docker("inspect", "--format", template, thing)
