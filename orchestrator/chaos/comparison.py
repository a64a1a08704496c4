"""Compares the results of two runs byte for byte: weights, episodes and transitions."""

from collections.abc import Iterator
from pathlib import Path

from msgspec import Struct

from orchestrator.chaos.rows import row_bytes, row_counts

CHUNK = 1 << 20
WEIGHTS, EPISODES, REPLAY = "weights.safetensors", "episodes.jsonl", "replay"


class Comparison(Struct, frozen=True, kw_only=True):
    """The comparison of a run under faults with the control run.

    Attributes:
        weights, episodes, replay: whether these are equal byte for byte.
        transitions: in the control run's replay journal; 0 where the learner keeps no journal.
        lost: transitions of the control run that this run lacks, counted by the rows of the journal, each a step of all
            drones.
        doubled: transitions that this run has more often than the control run, or that the control run lacks.
        differences: the first difference of each file that differs.
    """

    weights: bool
    episodes: bool
    replay: bool
    transitions: int
    lost: int
    doubled: int
    differences: tuple[str, ...]

    @property
    def identical(self) -> bool:
        """Whether all three are equal."""
        return self.weights and self.episodes and self.replay


def compare(control_run: Path, touched: Path, *, rows: int, drones: int) -> Comparison:
    """Compare two run directories.

    Args:
        rows: the rows of the control run's journal, each a step of all drones.
        drones: how many drones fly.

    Raises:
        RehearsalFailed: the control run's journal has another number of rows.
    """
    weights = _difference(control_run, touched, WEIGHTS)
    episodes = _difference(control_run, touched, EPISODES)
    segments = [_difference(control_run, touched, name) for name in _segments(control_run, touched)]
    size = row_bytes(control_run / REPLAY, rows)
    expected, found = row_counts(control_run / REPLAY, size), row_counts(touched / REPLAY, size)
    differences = (weights, episodes, *segments)
    return Comparison(
        weights=weights is None,
        episodes=episodes is None,
        replay=not any(segments),
        transitions=drones * expected.total(),
        lost=drones * (expected - found).total(),
        doubled=drones * (found - expected).total(),
        differences=tuple(difference for difference in differences if difference is not None),
    )


def _segments(*runs: Path) -> list[str]:
    """Every file under `replay/` of any of the runs."""
    found = {str(path.relative_to(run)) for run in runs for path in (run / REPLAY).rglob("*") if path.is_file()}
    return sorted(found)


def _difference(control_run: Path, touched: Path, name: str) -> str | None:
    """The first difference of the two files, in words; None where they are equal."""
    missing = [run for run in (control_run, touched) if not (run / name).is_file()]
    if missing:
        return f"{name} is missing in {' and '.join(map(str, missing))}"
    for offset, expected, found in _chunks(control_run / name, touched / name):
        if expected != found:
            return f"{name} differs from byte {offset + _first_difference(expected, found)} on"
    return None


def _chunks(control_run: Path, touched: Path) -> Iterator[tuple[int, bytes, bytes]]:
    with control_run.open("rb") as expected, touched.open("rb") as found:
        offset = 0
        while True:
            pair = expected.read(CHUNK), found.read(CHUNK)
            if pair == (b"", b""):
                return
            yield offset, *pair
            offset += CHUNK


def _first_difference(expected: bytes, found: bytes) -> int:
    shorter = min(len(expected), len(found))
    return next((index for index in range(shorter) if expected[index] != found[index]), shorter)
