"""Heatmaps and part-affinity fields as a perfect network would draw them for people whose joints are known."""

import numpy as np

from perception_worker.networks.decoding import LIMB_FIELDS, decode
from perception_worker.networks.network import NetworkOutput

STANDING = np.array(
    [
        *[(0.0, -6.0), (0.0, -4.0)],  # nose, neck
        *[(-2.0, -4.0), (-3.5, -1.5), (-3.5, 1.0)],  # right arm, to the left of the picture
        *[(2.0, -4.0), (3.5, -1.5), (3.5, 1.0)],
        *[(-1.2, 1.0), (-1.2, 5.0), (-1.2, 9.0)],
        *[(1.2, 1.0), (1.2, 5.0), (1.2, 9.0)],
        *[(-0.8, -7.2), (0.8, -7.2), (-1.8, -6.6), (1.8, -6.6)],  # eyes, ears
    ]
)
"""(18, 2) column and row in cells, around the middle of a person who looks at the camera."""


def person(column, row, *, scale=1.0, without=()):
    """(18, 2) joints of a standing person, NaN for those in `without`."""
    joints = STANDING * scale + (column, row)
    joints[list(without)] = np.nan
    return joints


def draw(people, *, size=(30, 40), heights=None):
    """The network's output for several people; each person's peaks are as high as `heights` says."""
    heatmaps = np.zeros((19, *size), np.float32)
    pafs = np.zeros((38, *size), np.float32)
    for joints, height in zip(people, heights or [0.8] * len(people), strict=True):
        for joint, place in enumerate(joints):
            if np.isfinite(place).all():
                heatmaps[joint] = np.maximum(heatmaps[joint], height * _blob(place, size))
        for first, second, channel in LIMB_FIELDS:
            if np.isfinite(joints[[first, second]]).all():
                _draw_limb(pafs[channel : channel + 2], joints[first], joints[second])
    heatmaps[18] = 1 - heatmaps[:18].max(axis=0)
    return NetworkOutput(heatmaps, pafs)


class DrawnNetwork:
    """Sees the given people in every picture."""

    input_size = (240, 320)

    def __init__(self, *people):
        self.output = draw(people)
        self.looks = 0

    def infer(self, rgb):
        assert rgb.dtype == np.uint8
        self.looks += 1
        return self.output

    def decode(self, output):
        return decode(output, 0.1)


def _blob(place, size):
    rows, columns = np.mgrid[: size[0], : size[1]]
    return np.exp(-((columns - place[0]) ** 2 + (rows - place[1]) ** 2) / (2 * 1.2**2))


def _draw_limb(field, start, end):
    rows, columns = np.mgrid[: field.shape[1], : field.shape[2]]
    direction = (end - start) / np.linalg.norm(end - start)
    along = (columns - start[0]) * direction[0] + (rows - start[1]) * direction[1]
    aside = np.abs((columns - start[0]) * direction[1] - (rows - start[1]) * direction[0])
    on_limb = (along > -1) & (along < np.linalg.norm(end - start) + 1) & (aside < 1)
    field[:, on_limb] = direction[:, None]
