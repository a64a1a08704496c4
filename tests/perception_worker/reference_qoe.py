"""Quality of Estimation once more, slowly and plainly, from the decided formulas: lists, loops and a flood fill.

Shares no code with the product, not even the names of the joints.
"""

import math

NECK = 1
RIGHT = {"shoulder": 2, "elbow": 3, "wrist": 4}
LEFT = {"shoulder": 5, "elbow": 6, "wrist": 7}


def combined(heatmaps, cells, points, others=()):
    """Mass, height, distance and their mean of each joint; all 0 where a cell is negative."""
    rows = []
    for joint, (cell, near) in enumerate(zip(cells, distance(points), strict=True)):
        if min(cell) < 0:
            rows.append((0.0, 0.0, 0.0, 0.0))
            continue
        share = mass(heatmaps[joint], cell, [other[joint] for other in others])
        high = height(heatmaps[joint], cell)
        rows.append((share, high, near, (share + high + near) / 3))
    return [list(column) for column in zip(*rows, strict=True)]


def mass(heatmap, cell, others=()):
    masked = _mask(heatmap)
    if masked[cell[0]][cell[1]] == 0:
        return 0.0
    own = _flood(masked, cell)
    theirs = set()
    for other in others:
        if min(other) >= 0:
            theirs |= _flood(masked, other) - own
    inside = sum(masked[row][column] for row, column in own)
    total = sum(
        value for row, values in enumerate(masked) for column, value in enumerate(values) if (row, column) not in theirs
    )
    return inside / total


def height(heatmap, cell):
    return min(max(_mask(heatmap)[cell[0]][cell[1]], 0.0), 1.0)


def distance(points):
    points = [None if any(math.isnan(value) for value in point) else list(point) for point in points]
    qualities = [_general(points, joint) for joint in range(18)]
    correct = {}
    for side in (RIGHT, LEFT):
        forearm = (_length(points, side["wrist"], side["elbow"]), 0.25, 0.60)
        arm = (_length(points, side["elbow"], side["shoulder"]), 0.25, 0.60)
        collarbone = (_length(points, side["shoulder"], NECK), 0.15, 0.45)
        for joint, bones in ((side["elbow"], (forearm, arm)), (side["shoulder"], (arm, collarbone))):
            correct[joint] = any(map(_plausible, bones))
            qualities[joint] = 1.0 if correct[joint] else _wrong(bones, qualities[joint])
        if correct[side["elbow"]]:
            qualities[side["wrist"]] = 1.0 if _plausible(forearm) else _wrong([forearm], qualities[side["wrist"]])
    collarbones = [(_length(points, side["shoulder"], NECK), 0.15, 0.45) for side in (RIGHT, LEFT)]
    qualities[NECK] = 1.0 if any(map(_plausible, collarbones)) else _wrong(collarbones, qualities[NECK])
    return [0.0 if point is None else quality for point, quality in zip(points, qualities, strict=True)]


def _mask(heatmap):
    heatmap = [[float(value) for value in row] for row in heatmap]
    mean = math.fsum(value for row in heatmap for value in row) / (len(heatmap) * len(heatmap[0]))
    return [[value if value >= max(mean, 0.0) else 0.0 for value in row] for row in heatmap]


def _flood(masked, cell):
    reached, waiting = set(), [tuple(cell)]
    while waiting:
        row, column = waiting.pop()
        inside = 0 <= row < len(masked) and 0 <= column < len(masked[0])
        if inside and masked[row][column] > 0 and (row, column) not in reached:
            reached.add((row, column))
            waiting += [(row + down, column + right) for down in (-1, 0, 1) for right in (-1, 0, 1)]
    return reached


def _length(points, first, second):
    return None if points[first] is None or points[second] is None else math.dist(points[first], points[second])


def _plausible(bone):
    length, shortest, longest = bone
    return length is not None and shortest <= length <= longest


def _wrong(bones, otherwise):
    measured = [bone for bone in bones if bone[0] is not None]
    if not measured:
        return otherwise
    if any(length < shortest for length, shortest, _ in measured):
        return 0.0
    return 1.0 - _w(sum(length - longest for length, _, longest in measured) / len(measured))


def _general(points, joint):
    others = [point for other, point in enumerate(points) if point is not None and other != joint]
    if points[joint] is None or not others:
        return 0.0
    centre = [sum(coordinates) / len(others) for coordinates in zip(*others, strict=True)]
    return 1.0 - _w(math.dist(points[joint], centre))


def _w(x):
    if x <= 1.5:
        return 0.0
    return 1.0 if x >= 1.875 else 4 / 1.5 * (x - 1.5)
