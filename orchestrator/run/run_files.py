"""Where the files of a run lie in its directory."""

from pathlib import Path

from msgspec import Struct

from protocol.text import readable


class RunFiles(Struct, frozen=True):
    """The paths of one run."""

    path: Path

    @property
    def name(self) -> str:
        """The directory's name, as text that can be sent."""
        return readable(self.path.resolve().name)

    @property
    def config_path(self) -> Path:
        """The resolved configuration, with every default; every process of the run reads it."""
        return self.path / "config.toml"

    @property
    def workers_path(self) -> Path:
        """The records of the processes that were last started on this run."""
        return self.path / "workers.json"

    @property
    def progress_path(self) -> Path:
        """The agent's progress, one JSON object a line."""
        return self.path / "progress.jsonl"

    @property
    def weights_path(self) -> Path:
        """The weights that the agent learned."""
        return self.path / "weights.safetensors"

    @property
    def summary_path(self) -> Path:
        """The summary of the training, also of one that was stopped."""
        return self.path / "summary.json"

    @property
    def restarts_path(self) -> Path:
        """Each restart of a process, one JSON object a line."""
        return self.path / "restarts.jsonl"

    @property
    def evaluation_path(self) -> Path:
        """The result of the evaluation."""
        return self.path / "evaluation.json"

    @property
    def grid_path(self) -> Path:
        """The details of the evaluation, of a run on the grid."""
        return self.path / "grid.json"

    @property
    def ending_path(self) -> Path:
        """How the last work on the run ended; missing while an orchestrator works on it."""
        return self.path / "ending.json"

    @property
    def logs(self) -> Path:
        """One file of JSON lines for each process."""
        return self.path / "logs"

    @property
    def orchestrator_log(self) -> Path:
        """The orchestrator's own log."""
        return self.logs / "orchestrator.jsonl"
