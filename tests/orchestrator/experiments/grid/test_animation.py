"""The animated episode: which one is chosen, and what is in the file."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

from orchestrator.experiments.grid.animation import (
    LAST_MILLISECONDS,
    STEP_MILLISECONDS,
    AnimatedEpisode,
    animate,
    telling_episode,
)
from orchestrator.experiments.grid.walked import Walked, positions_of
from protocol.errors import DamagedRecord, InvalidInput
from protocol.grid.table import CELLS, GridPlace, cell_of


def walked(*paths: list[int]) -> Walked:
    path = np.full((len(paths), 12), -1, np.int16)
    for number, cells in enumerate(paths):
        path[number, : len(cells)] = cells
    return Walked(threshold=1.0, place=np.zeros(len(paths), np.intp), path=path)


def views() -> np.ndarray:
    weighted = np.full((1, CELLS), 5.0)
    weighted[0, cell_of(3, 0)] = 0.5
    weighted[0, cell_of(-3, 0)] = 9.0
    weighted[0, cell_of(-9, 0)] = 10.0
    return weighted


GOAL = cell_of(3, 0)


def test_the_episode_succeeds_has_the_length_and_begins_where_the_person_is_seen_worst() -> None:
    episodes = walked(
        [cell_of(4, 0), GOAL],
        [cell_of(-3, 0), cell_of(0, 3), GOAL],
        [cell_of(-3, 0), cell_of(0, 3), cell_of(1, 1)],
        [cell_of(-9, 0), cell_of(0, 3), GOAL],
        [cell_of(5, 5), cell_of(4, 4), GOAL],
    )
    assert telling_episode(episodes, views(), 2) == 1
    assert telling_episode(episodes, views(), 1) == 0


def test_without_a_success_there_is_nothing_to_show() -> None:
    with pytest.raises(InvalidInput, match="no episode"):
        telling_episode(walked([cell_of(5, 5), cell_of(4, 4)]), views(), 1)


def test_the_file_has_a_frame_for_each_cell_and_rests_on_the_last(tmp_path: Path) -> None:
    place = GridPlace(split="test", seed=1, identity=41, pose=0, yaw=0.0)
    cells = (cell_of(-3, 0), cell_of(0, 3), GOAL)
    episode = AnimatedEpisode(place, views()[0], 1.0, cells)
    seen = [np.full((48, 64, 3), shade, np.uint8) for shade in (40, 120, 200)]
    animate(tmp_path / "episode.gif", episode, seen)
    with Image.open(tmp_path / "episode.gif") as picture:
        frames = [(frame.convert("RGB").copy(), frame.info["duration"]) for frame in ImageSequence.Iterator(picture)]
    assert [duration for _, duration in frames] == [STEP_MILLISECONDS, STEP_MILLISECONDS, LAST_MILLISECONDS]
    shades = [frame.getpixel((100, 100))[0] for frame, _ in frames]
    assert shades == sorted(shades)
    assert shades[-1] - shades[0] > 100


def test_positions_are_metres_from_the_person() -> None:
    assert positions_of([cell_of(-9, 9), cell_of(0, 0), cell_of(4, -2)]).tolist() == [[-9, 9], [0, 0], [4, -2]]


def test_damaged_walks_are_named(tmp_path: Path) -> None:
    (tmp_path / "walks.npz").write_bytes(b"no zip")
    for name in ("walks.npz", "missing.npz"):
        with pytest.raises(DamagedRecord, match=name):
            Walked.read(tmp_path / name)
