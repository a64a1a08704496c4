"""An episode as an animated picture: what the camera saw, beside the map with the walk so far."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure as Picture
from msgspec import Struct
from numpy.typing import NDArray
from PIL import Image

from orchestrator.experiments.grid.plots import draw_map, draw_walk
from orchestrator.experiments.grid.walked import Walked, positions_of
from protocol.arrays import Float64Array, UInt8Array
from protocol.artifact import whole_file
from protocol.errors import InvalidInput
from protocol.grid.table import GridPlace
from protocol.grid.threshold import best_uncertainties

HEIGHT = 240
"""Of the picture, in pixels."""

COLOURS = 96
STEP_MILLISECONDS, LAST_MILLISECONDS = 600, 2400


class AnimatedEpisode(Struct, frozen=True, eq=False):
    """An episode to draw.

    Attributes:
        place: the environment.
        weighted: (361,) the weighted uncertainty of each of its cells.
        cells: from the start to the end.
    """

    place: GridPlace
    weighted: Float64Array
    threshold: float
    cells: tuple[int, ...]


def telling_episode(walked: Walked, weighted: Float64Array, length: int) -> int:
    """The number of the episode, of those that succeed, that begins where the person is seen worst, of some length.

    Args:
        weighted: (n, 361) of the split's environments.
        length: steps; the nearest length that there is.

    Raises:
        InvalidInput: no episode succeeds.
    """
    lengths = (walked.path >= 0).sum(axis=1) - 1
    ends = walked.path[np.arange(len(lengths)), lengths]
    won = np.flatnonzero(weighted[walked.place, ends] < walked.threshold)
    if not len(won):
        raise InvalidInput("no episode of the run succeeds")
    nearest = won[np.abs(lengths[won] - length) == np.abs(lengths[won] - length).min()]
    # Far out, everybody is seen badly: the start is best within the reach of a view, and behind the person.
    start = walked.path[nearest, 0]
    behind = weighted[walked.place[nearest], start] - 10.0 * (weighted[walked.place[nearest], start] >= 10.0)
    solvable = best_uncertainties(weighted)[walked.place[nearest]]
    return int(nearest[np.lexsort((solvable, -behind))[0]])


def animate(path: Path, episode: AnimatedEpisode, seen: Sequence[UInt8Array]) -> None:
    """Write an episode as an animated GIF.

    Args:
        seen: of each cell of the walk what the camera saw, (h, w, 3).
    """
    frames = [_frame(episode, number, image) for number, image in enumerate(seen)]
    palette = frames[0].quantize(COLOURS, dither=Image.Dither.NONE)
    drawn = [frame.quantize(COLOURS, palette=palette, dither=Image.Dither.NONE) for frame in frames]
    durations = [STEP_MILLISECONDS] * (len(drawn) - 1) + [LAST_MILLISECONDS]
    with whole_file(path) as aside:
        drawn[0].save(
            aside, format="GIF", save_all=True, append_images=drawn[1:], duration=durations, loop=0, optimize=True
        )


def _frame(episode: AnimatedEpisode, number: int, seen: UInt8Array) -> Image.Image:
    camera = Image.fromarray(seen).resize((HEIGHT * 4 // 3, HEIGHT))
    beside = Image.fromarray(_map(episode, number))
    frame = Image.new("RGB", (camera.width + beside.width, HEIGHT))
    frame.paste(camera, (0, 0))
    frame.paste(beside, (camera.width, 0))
    return frame


def _map(episode: AnimatedEpisode, number: int) -> NDArray[np.uint8]:
    picture = Picture(figsize=(HEIGHT / 100, HEIGHT / 100), dpi=100)
    place = picture.add_axes((0.0, 0.0, 1.0, 0.9))
    draw_map(place, episode.weighted, episode.threshold, episode.place.yaw)
    draw_walk(place, positions_of(episode.cells[: number + 1]))
    place.set_axis_off()
    uncertainty = episode.weighted[episode.cells[number]]
    picture.text(0.5, 0.95, f"step {number}: uncertainty {uncertainty:.2f}", ha="center", va="center", fontsize=8)
    drawn = io.BytesIO()
    picture.savefig(drawn, format="png", dpi=100)
    return np.asarray(Image.open(drawn).convert("RGB"))
