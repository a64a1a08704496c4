"""The page of one scene: the camera's picture, the network's output, and the uncertainty of each joint."""

from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct
from PIL import Image, ImageDraw, ImageFont

from orchestrator.pictures import picture
from orchestrator.pictures.person_in_space import PersonInSpace, person_in_space
from orchestrator.pictures.picture import RGB, DepthScale
from orchestrator.pictures.space_picture import GRID, VIEWS, Volume, space_legend, space_picture, volume_around
from protocol.arrays import Float32Array, UInt8Array
from protocol.frame import Frame
from protocol.pose_estimate import PoseEstimate
from protocol.skeleton import Joint, weighted_uncertainty

PANEL_WIDTH = 640
MARGIN = 32
GAP = 20
BAR_WIDTH = 18
BAR_COLUMN = 90
TABLE_WIDTH = 400
HEADER = 104
CAPTION = 32
ROW = 27
SPACE_HEIGHT = 560
"""Of a picture in space."""

PAPER: RGB = (250, 250, 248)
INK: RGB = (28, 28, 32)
FAINT: RGB = (110, 110, 116)
RULE: RGB = (214, 214, 210)

ROUND_DISTANCES = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)
"""Metres at which a depth scale may have a tick."""
CLOSEST_TICKS = 0.05
"""Of the scale's height."""

QUALITY_COLUMNS: tuple[tuple[str, int], ...] = (("mass", 150), ("height", 212), ("distance", 280), ("quality", 352))
"""Headings of the table of joints, and the middle of each column in pixels from the table's left."""


METRE_COLUMNS: tuple[tuple[str, str, int], ...] = (("expected_error", "error", 430), ("radius", "radius", 500))
"""Of a calibrated worker, in metres: what of the observation, its heading, and the middle of its column."""
METRES_WIDTH = 140


class ScenePage:
    """A page to put pictures and words on; positions are pixels from its upper left corner."""

    def __init__(self, width: int, height: int) -> None:
        self._image = Image.new("RGB", (width, height), PAPER)
        self._pen = ImageDraw.Draw(self._image)

    def pixels(self) -> UInt8Array:
        """The page as (height, width, 3) RGB."""
        return np.asarray(self._image)

    def paste(self, pixels: UInt8Array, x: int, y: int) -> None:
        """Put a picture on the page."""
        self._image.paste(Image.fromarray(pixels), (x, y))

    def write(self, text: str, x: float, y: float, size: int = 17, colour: RGB = INK, anchor: str = "la") -> None:
        """Write a line; `anchor` is Pillow's (`la` from the upper left, `mm` around the middle)."""
        self._pen.text((x, y), text, fill=colour, font=ImageFont.load_default(size), anchor=anchor)

    def box(self, x: float, y: float, width: float, height: float, fill: RGB) -> None:
        """Fill a rectangle."""
        self._pen.rectangle((x, y, x + width - 1, y + height - 1), fill=fill)


class Place(Struct, frozen=True):
    """Where the upper left corner of a part of the page is."""

    x: int
    y: int


def draw_scene_page(
    title: str, subtitle: str, frame: Frame, observation: PoseEstimate, yaw: float | None = None
) -> UInt8Array:
    """The page of one scene, (height, width, 3) RGB; truth and heatmaps are drawn where they are there.

    Args:
        yaw: the person's, radians from world x; by their shoulders where it is not told.
    """
    height, width = frame.depth.shape
    panel_height = round(PANEL_WIDTH * height / width)
    left, right = MARGIN, MARGIN + PANEL_WIDTH + GAP
    upper, lower = HEADER, HEADER + CAPTION + panel_height + GAP
    table = Place(right + PANEL_WIDTH + BAR_COLUMN + GAP, upper)
    space = Place(left, max(lower + CAPTION + panel_height, upper + _table_height()) + GAP)
    page_width = table.x + _table_width(observation) + MARGIN
    page = ScenePage(page_width, space.y + 2 * CAPTION + SPACE_HEIGHT + MARGIN)
    person = person_in_space(frame, observation, yaw)
    page.write(title, left, 26, 30)
    page.write(subtitle, left, 68, 18, FAINT)
    _put_panel(page, Place(left, upper), "Colour", frame.rgb)
    _put_depth(page, Place(right, upper), frame.depth, panel_height)
    _put_heatmaps(page, Place(left, lower), frame, observation)
    _put_skeleton(page, Place(right, lower), frame, observation, panel_height)
    _put_table(page, table, observation, person)
    _put_space(page, space, page_width - 2 * MARGIN, person)
    return page.pixels()


def _put_panel(page: ScenePage, place: Place, caption: str, panel: UInt8Array) -> None:
    page.write(caption, place.x, place.y + CAPTION / 2, anchor="lm")
    page.paste(picture.enlarged(panel, PANEL_WIDTH), place.x, place.y + CAPTION)


def _put_depth(page: ScenePage, place: Place, depth: Float32Array, height: int) -> None:
    scale = picture.depth_scale(depth)
    _put_panel(page, place, "Depth (grey: not measured)", picture.depth_picture(depth, scale))
    ramp = scale.distance(np.linspace(1.0, 0.0, height)).astype(np.float32)
    colours = picture.depth_picture(ramp[:, None], scale)[:, 0]
    ticks = [(1 - share, f"{metres:g} m") for metres, share in depth_ticks(scale)]
    _put_bar(page, Place(place.x + PANEL_WIDTH + GAP // 2, place.y + CAPTION), colours, ticks)


def _put_heatmaps(page: ScenePage, place: Place, frame: Frame, observation: PoseEstimate) -> None:
    if observation.heatmaps is not None:
        area = picture.Window(*observation.heatmap_area) if observation.heatmap_area is not None else None
        panel = picture.heatmap_picture(frame.rgb, observation.heatmaps, area)
        _put_panel(page, place, "Heatmaps, the highest of 18 joints", panel)


def _put_skeleton(page: ScenePage, place: Place, frame: Frame, observation: PoseEstimate, height: int) -> None:
    true_pixels = picture.true_pixels(frame.joints, frame.camera) if frame.joints is not None else np.empty((0, 2))
    window = picture.window_around(np.concatenate([observation.keypoints, true_pixels]), *frame.rgb.shape[1::-1])
    panel = picture.enlarged(picture.cut(frame.rgb, window), PANEL_WIDTH)
    keypoints = picture.magnified_pixels(observation.keypoints, window, PANEL_WIDTH)
    panel = picture.skeleton_picture(panel, keypoints, observation.quality)
    if frame.visible is not None:
        truth = picture.magnified_pixels(true_pixels, window, PANEL_WIDTH)
        panel = picture.truth_picture(panel, truth, frame.visible)
    zoom = frame.rgb.shape[1] / window.width
    _put_panel(page, place, f"Skeleton, joints coloured by quality ({zoom:.1f} times as large)", panel)
    levels = np.linspace(1.0, 0.0, height)
    colours = np.array([picture.quality_colour(float(level)) for level in levels], np.uint8)
    ticks = [(1 - level, f"{level:g}") for level in (0.0, 0.25, 0.5, 0.75, 1.0)]
    _put_bar(page, Place(place.x + PANEL_WIDTH + GAP // 2, place.y + CAPTION), colours, ticks)


def _put_space(page: ScenePage, place: Place, width: int, person: PersonInSpace) -> None:
    """The person from three sides, side by side in a row of a `width`."""
    width = (width - (len(VIEWS) - 1) * GAP) // len(VIEWS)
    volume = volume_around(person.all_points(), width, SPACE_HEIGHT)
    heading = f"In space: squares of {GRID:g} m, the ground a thick line"
    page.write(heading, place.x, place.y + CAPTION / 2, anchor="lm")
    page.write(space_words(person, volume), place.x + width + GAP, place.y + CAPTION / 2, anchor="lm")
    for number, view in enumerate(VIEWS):
        x, y = place.x + number * (width + GAP), place.y + CAPTION
        page.write(view.caption, x, y + CAPTION / 2, 15, FAINT, anchor="lm")
        page.paste(space_picture(view, volume, person), x, y + CAPTION)


def space_words(person: PersonInSpace, volume: Volume) -> str:
    """How far off the joints are, and how many lie outside of one of the pictures or more."""
    located = np.isfinite(person.points).all(axis=1)
    outside = int((located & ~volume.shows(person.points)).sum())
    if outside == 0:
        return person.in_words()
    return f"{person.in_words()} {outside} joint{'s lie' if outside > 1 else ' lies'} outside of the pictures."


def _put_bar(page: ScenePage, place: Place, colours: UInt8Array, ticks: Sequence[tuple[float, str]]) -> None:
    """A scale from top to bottom: `colours` (height, 3), ticks at shares of its height."""
    page.paste(np.repeat(colours[:, None], BAR_WIDTH, axis=1), place.x, place.y)
    height = len(colours)
    for share, label in ticks:
        y = place.y + min(max(share * (height - 1), 8), height - 9)
        page.write(label, place.x + BAR_WIDTH + 8, y, 15, anchor="lm")


def depth_ticks(scale: DepthScale) -> list[tuple[float, float]]:
    """Round distances, in metres, with their shares of the scale, far enough apart to be read."""
    shares = scale.share(np.array(ROUND_DISTANCES))
    ticks: list[tuple[float, float]] = []
    for metres, share in zip(ROUND_DISTANCES, shares.tolist(), strict=True):
        if 0 <= share <= 1 and (not ticks or ticks[-1][1] - share >= CLOSEST_TICKS):
            ticks.append((metres, share))
    return ticks


def _table_width(observation: PoseEstimate) -> int:
    return TABLE_WIDTH + (METRES_WIDTH if observation.radius is not None else 0)


def _table_height() -> int:
    return CAPTION + ROW * (len(Joint) + 12)


def _put_table(page: ScenePage, place: Place, observation: PoseEstimate, person: PersonInSpace) -> None:
    y = place.y + CAPTION // 2
    page.write("Joint", place.x, y, anchor="lm")
    for heading, x in QUALITY_COLUMNS:
        page.write(heading, place.x + x, y, 15, FAINT, anchor="mm")
    for field, heading, x in METRE_COLUMNS:
        if getattr(observation, field) is not None:
            page.write(f"{heading}, m", place.x + x, y, 15, FAINT, anchor="mm")
    for joint in Joint:
        y += ROW
        _put_joint(page, place.x, y, joint, observation)
    uncertainty = weighted_uncertainty(observation.quality)
    page.box(place.x, y + ROW // 2 + 4, _table_width(observation), 1, RULE)
    y += ROW + 12
    page.write(f"Weighted uncertainty of the upper body: {uncertainty:.2f} of 10", place.x, y, anchor="lm")
    _put_legend(page, Place(place.x, y + ROW + 8), person)


def _put_joint(page: ScenePage, x: int, y: int, joint: Joint, observation: PoseEstimate) -> None:
    found, inferred = bool(np.isfinite(observation.keypoints[joint]).all()), bool(observation.inferred[joint])
    page.write(joint.name.replace("_", " ").lower(), x, y, 16, INK if found or inferred else FAINT, anchor="lm")
    if found:
        _put_quality(page, x, y, joint, observation)
    else:
        middle = x + (QUALITY_COLUMNS[0][1] + QUALITY_COLUMNS[-1][1]) / 2
        page.write("not seen: inferred" if inferred else "not found", middle, y, 15, FAINT, anchor="mm")
    for field, _, column in METRE_COLUMNS:
        metres = getattr(observation, field)
        if metres is not None and np.isfinite(metres[joint]):
            page.write(f"{float(metres[joint]):.2f}", x + column, y, 15, anchor="mm")


def _put_quality(page: ScenePage, x: int, y: int, joint: Joint, observation: PoseEstimate) -> None:
    for name, column in QUALITY_COLUMNS[:-1]:
        page.write(f"{float(getattr(observation, name)[joint]):.2f}", x + column, y, 15, FAINT, anchor="mm")
    column = QUALITY_COLUMNS[-1][1]
    quality = float(observation.quality[joint])
    colour = picture.quality_colour(quality)
    page.box(x + column - 30, y - ROW / 2 + 2, 60, ROW - 4, colour)
    ink = INK if sum(colour) > 420 else PAPER
    page.write(f"{quality:.2f}", x + column, y, 15, ink, anchor="mm")


def _put_legend(page: ScenePage, place: Place, person: PersonInSpace) -> None:
    space = space_legend(radii=person.radius is not None, truth=person.truth is not None)
    for row, (text, swatch) in enumerate([*_skeleton_legend(), *space]):
        y = place.y + row * ROW
        page.paste(swatch, place.x, y - 9)
        page.write(text, place.x + 54, y, 16, anchor="lm")


def _skeleton_legend() -> Iterator[tuple[str, UInt8Array]]:
    for text, colour in (
        ("the person's left", picture.LEFT_COLOUR),
        ("the person's right", picture.RIGHT_COLOUR),
        ("middle", picture.MIDDLE_COLOUR),
    ):
        swatch = np.full((18, 40, 3), picture.UNKNOWN_COLOUR, np.uint8)
        swatch[7:11, 5:35] = colour
        yield text, swatch
    for text, visible in (("true joint, in the camera's sight", True), ("true joint, hidden", False)):
        swatch = np.full((18, 40, 3), picture.UNKNOWN_COLOUR, np.uint8)
        picture.cross(swatch, np.array([19.5, 8.5]), visible=visible)
        yield text, swatch
