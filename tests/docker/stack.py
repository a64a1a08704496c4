"""The compose file as a project on an engine, with a short training in it."""

import subprocess
from collections.abc import Mapping
from pathlib import Path

import psutil

from orchestrator.chaos.progress_log import ProgressLog
from tests.docker.engine import REPOSITORY, Engine
from tests.docker.waiting import PATIENCE

HERE = Path(__file__).parent
COMPOSE = REPOSITORY / "docker" / "compose.yaml"
SERVICES = ("orchestrator", "render", "perception", "agent")

_METRICS = "import urllib.request as w; print(w.urlopen('http://127.0.0.1:8002/metrics').read().decode())"
_RENDERERS = 'vantage_workers{at_work="true",serves="render"}'


class Stack:
    """A project of its own name, with keys of its own.

    Args:
        keys: a folder for them, with one for each role in it.
        files: compose files beside `compose.yaml`.
    """

    def __init__(
        self,
        engine: Engine,
        name: str,
        keys: Path,
        *,
        config: Path = HERE / "short.toml",
        files: tuple[Path, ...] = (),
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.engine = engine
        self.name = name
        self.config = config
        self._files = (COMPOSE, *files)
        self.environment = {
            "VANTAGE_CONFIG": str(config),
            "VANTAGE_KEYS": str(keys),
            "VANTAGE_RUN": "short",
            **(environment or {}),
        }
        for service in SERVICES:
            (keys / service).mkdir(parents=True, exist_ok=True)
        self.progress: ProgressLog | None = None

    def compose(self, *words: str, timeout: float = PATIENCE) -> str:
        """Run `docker compose WORDS` on the project."""
        return self.engine.docker("compose", *self._options(), *words, environment=self.environment, timeout=timeout)

    def try_compose(self, *words: str, timeout: float = PATIENCE) -> subprocess.CompletedProcess[str]:
        """The same, whatever comes of it."""
        return self.engine.run("compose", *self._options(), *words, environment=self.environment, timeout=timeout)

    def remove(self) -> None:
        """Remove containers, volumes and networks, also those that a killed test has left."""
        self.compose("down", "--volumes", "--remove-orphans", "--timeout", "5")

    def container(self, service: str) -> str:
        """The identity of a service's first container."""
        return self.compose("ps", "--all", "--quiet", service).splitlines()[0]

    def process(self, service: str) -> psutil.Process:
        """The process in a service's container that does its work, as this machine knows it: tini's child."""
        init = psutil.Process(int(self.engine.inspect(self.container(service), "{{.State.Pid}}")))
        return init.children()[0]

    def health(self, service: str) -> str:
        """What the engine says of a service's container: `starting`, `healthy` or `unhealthy`."""
        return self.engine.inspect(self.container(service), "{{.State.Health.Status}}")

    def restarts(self, service: str) -> int:
        """How often the engine has started a service's container again by itself."""
        return int(self.engine.inspect(self.container(service), "{{.RestartCount}}"))

    def scale(self, service: str, number: int) -> None:
        """Have so many containers of a service, and leave all others alone."""
        scaled = ("--no-build", "--no-recreate", "--no-deps", "--scale", f"{service}={number}", service)
        self.compose("up", "--detach", *scaled)

    def renderers_at_work(self) -> int:
        """How many the perception worker can call now, by its metrics."""
        told = self.engine.run("exec", self.container("perception"), "python", "-c", _METRICS)
        lines = told.stdout.splitlines()
        counts = [line.split()[-1] for line in lines if line.startswith(_RENDERERS)]
        return int(float(counts[0])) if counts else 0

    def exit_code(self, service: str) -> int | None:
        """With what a service's container has ended; None while it runs."""
        status, code = self.engine.inspect(self.container(service), "{{.State.Status}} {{.State.ExitCode}}").split()
        return int(code) if status == "exited" else None

    def exit_codes(self) -> dict[str, int | None]:
        """The same of all."""
        return {service: self.exit_code(service) for service in SERVICES}

    def run_directory(self) -> Path:
        """The run in its volume, where this machine has it."""
        volume = self.engine.docker("volume", "inspect", "--format", "{{.Mountpoint}}", f"{self.name}_runs")
        return Path(volume) / "short"

    def read_progress(self) -> ProgressLog:
        """How far the training is."""
        if self.progress is None:
            self.progress = ProgressLog(self.run_directory() / "progress.jsonl")
        self.progress.read()
        return self.progress

    def log(self, service: str) -> str:
        """All that a service has said."""
        return self.compose("logs", "--no-log-prefix", service)

    def _options(self) -> list[str]:
        return ["--project-name", self.name, *(word for file in self._files for word in ("--file", str(file)))]
