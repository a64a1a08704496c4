"""What two trainings of the same configuration have in common, whatever happened to them on the way."""

import shutil
import tempfile
from pathlib import Path

from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from agent.checkpointing.checkpoint import REST, TENSORS
from agent.checkpointing.weights import FILE_NAME as WEIGHTS


def result(run: Path) -> dict[str, object]:
    """All that a training comes to: each part by name."""
    newest = max((run / "checkpoints").glob("step-*"))
    parts: dict[str, object] = {name: (run / name).read_bytes() for name in (WEIGHTS, "episodes.jsonl")}
    parts |= {f"replay/{path.name}": path.read_bytes() for path in (run / "replay").glob("*")}
    parts |= {f"{newest.name}/{name}": (newest / name).read_bytes() for name in (WEIGHTS, TENSORS, REST)}
    return parts | {"curves": curves(run)}


def differing(run: Path, other: Path) -> set[str]:
    """The names of the parts in which two trainings differ."""
    one, two = result(run), result(other)
    return {name for name in one.keys() | two.keys() if one.get(name) != two.get(name)}


def curves(run: Path) -> dict[str, list[tuple[int, float]]]:
    """The points of all curves but those of speed."""
    with tempfile.TemporaryDirectory() as directory:
        # TensorBoard reads files in the order of their names, which is that of their making only between seconds.
        files = sorted((run / "tensorboard").iterdir(), key=lambda path: path.stat().st_mtime_ns)
        for number, path in enumerate(files):
            shutil.copy(path, Path(directory) / f"events.out.tfevents.{number:010d}")
        events = EventAccumulator(directory).Reload()
    tags = [tag for tag in events.Tags()["scalars"] if not tag.startswith(("Seconds a step", "Training /"))]
    return {tag: [(point.step, point.value) for point in events.Scalars(tag)] for tag in tags}
