"""Walls and ceilings of halls. A wall's image (512, 1024, 3) is as high as the hall, its first row at the floor."""

from collections.abc import Callable, Mapping

import cv2
import numpy as np

from protocol.arrays import UInt8Array
from render_worker.arrays import RealArray
from render_worker.noise import seamless_noise
from render_worker.people.outfit import Colour

ROWS, COLUMNS = 512, 1024

_Photographs = Mapping[str, UInt8Array]
_Made = tuple[UInt8Array, UInt8Array]


def _painted(colour: Colour, strength: float, seed: int) -> RealArray:
    noise = np.tile(seamless_noise(ROWS, 1.3, 1.0, seed), (1, COLUMNS // ROWS))
    return np.array(colour, np.float32) * (1 + strength * noise)[..., None]


def _skirting(wall: RealArray, colour: Colour, rows: int = 14) -> RealArray:
    wall[:rows] = colour
    wall[rows : rows + 2] *= 0.7
    return wall


def _picture(wall: RealArray, photograph: UInt8Array, column: int, row: int, width: int) -> None:
    """Hang a framed photograph."""
    height = width * photograph.shape[0] // photograph.shape[1]
    image = cv2.resize(photograph, (width, height), interpolation=cv2.INTER_AREA)[::-1]
    wall[row - 6 : row + height + 6, column - 6 : column + width + 6] = (54, 48, 44)
    wall[row : row + height, column : column + width] = image


def _finish(values: RealArray) -> UInt8Array:
    return np.clip(values, 0, 255).astype(np.uint8)


def _ceiling(colour: Colour, seed: int) -> UInt8Array:
    plates = np.array(colour, np.float32) * (1 + 0.02 * seamless_noise(ROWS, 1.0, 1.0, seed))[..., None]
    groove = np.arange(ROWS) % 128 < 3
    plates[groove] *= 0.8
    plates[:, groove] *= 0.8
    plates[200:312, 60:196] = (250, 250, 244)
    return _finish(plates)


def _plaster(photographs: _Photographs) -> _Made:
    wall = _skirting(_painted((206, 198, 184), 0.03, 81), (92, 84, 76))
    _picture(wall, photographs["coffee"], 180, 180, 200)
    _picture(wall, photographs["chelsea"], 660, 190, 160)
    return _finish(wall), _ceiling((226, 226, 222), 82)


def _brick(photographs: _Photographs) -> _Made:
    grey = np.tile(photographs["brick"].mean(axis=2), (1, COLUMNS // ROWS))
    shading = 1 + 0.6 * (grey / grey.mean() - 1)
    return _finish(_skirting(shading[..., None] * np.array((158, 116, 98)), (78, 74, 70))), _ceiling(
        (196, 196, 194), 83
    )


def _panels(_: _Photographs) -> _Made:
    wall = _painted((176, 186, 190), 0.02, 84)
    seam = np.arange(COLUMNS) % 128 < 3
    wall[:, seam] *= 0.72
    wall[170:174] *= 0.72
    wall[:170] *= np.array((0.82, 0.86, 0.9))
    return _finish(_skirting(wall, (96, 100, 104))), _ceiling((232, 232, 230), 85)


def _windows(_: _Photographs) -> _Made:
    wall = _skirting(_painted((192, 190, 198), 0.03, 86), (104, 98, 92))
    for left in (110, 620):
        wall[130:430, left : left + 300] = (96, 92, 90)
        pane = np.linspace(0, 1, 284)[:, None, None]
        wall[138:422, left + 8 : left + 292] = (1 - pane) * np.array((176, 190, 176)) + pane * np.array((206, 222, 236))
        wall[138:422, left + 146 : left + 154] = (96, 92, 90)
        wall[276:284, left + 8 : left + 292] = (96, 92, 90)
    return _finish(wall), _ceiling((214, 214, 210), 87)


WALLS: dict[str, Callable[[_Photographs], _Made]] = {
    "hall-plaster": _plaster,
    "hall-brick": _brick,
    "hall-panels": _panels,
    "hall-windows": _windows,
}
