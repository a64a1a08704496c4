"""What two trainings of the same configuration have in common, whatever happened to them on the way."""

from pathlib import Path

from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from agent.checkpoint import REST, TENSORS
from agent.weights import FILE_NAME as WEIGHTS


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
    events = EventAccumulator(str(run / "tensorboard")).Reload()
    tags = [tag for tag in events.Tags()["scalars"] if not tag.startswith(("Seconds a step", "Training /"))]
    return {tag: [(point.step, point.value) for point in events.Scalars(tag)] for tag in tags}
