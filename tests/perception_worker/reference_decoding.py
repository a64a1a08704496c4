"""Decoding once more, slowly and plainly: lists and loops over cells, peaks and samples.

Shares no code with the product, not even the table of limbs.
"""

import math

JOINTS = 18
LIMBS = [
    *[(1, 2, 12), (1, 5, 20), (2, 3, 14), (3, 4, 16), (5, 6, 22), (6, 7, 24), (1, 8, 0), (8, 9, 2), (9, 10, 4)],
    *[(1, 11, 6), (11, 12, 8), (12, 13, 10), (1, 0, 28), (0, 14, 30), (14, 16, 34), (0, 15, 32), (15, 17, 36)],
    *[(2, 16, 18), (5, 17, 26)],
]
MOST = 16


def people(heatmaps, pafs, threshold):
    """Everybody as {joint: (column, row)}, whoever shows the most joints first."""
    heatmaps, pafs = [one.tolist() for one in heatmaps[:JOINTS]], pafs.tolist()
    of_joint = [peaks(heatmap, threshold) for heatmap in heatmaps]
    skeletons = []
    for first, second, channel in LIMBS:
        candidates = []
        for b, (end, _) in enumerate(of_joint[second]):
            for a, (start, _) in enumerate(of_joint[first]):
                score = _score(pafs[channel], pafs[channel + 1], start, end)
                if score is not None:
                    candidates.append((-score, len(candidates), a, b))
        for _, _, a, b in sorted(candidates):
            _add(skeletons, (first, a), (second, b))
    skeletons.sort(
        key=lambda one: (len(one), sum(of_joint[joint][peak][1] for joint, peak in one.items())), reverse=True
    )
    return [{joint: of_joint[joint][peak][0] for joint, peak in one.items()} for one in skeletons]


def peaks(heatmap, threshold):
    """((column, row), height), highest first."""
    found = []
    for row, values in enumerate(heatmap):
        for column, value in enumerate(values):
            if value > threshold and _is_summit(heatmap, row, column):
                across = _offset(values, column)
                down = _offset([line[column] for line in heatmap], row)
                found.append(((column + across, row + down), value))
    return sorted(found, key=lambda peak: -peak[1])[:MOST]


def _is_summit(heatmap, row, column):
    here = heatmap[row][column]
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            inside = 0 <= row + down < len(heatmap) and 0 <= column + right < len(heatmap[0])
            if not inside or (down, right) == (0, 0):
                continue
            other = heatmap[row + down][column + right]
            if other > here or (other == here and (down, right) < (0, 0)):
                return False
    return True


def _offset(values, place):
    if not 0 < place < len(values) - 1:
        return 0.0
    before, here, after = values[place - 1 : place + 2]
    curvature = before - 2 * here + after
    return min(max(0.5 * (before - after) / curvature, -0.5), 0.5) if curvature < 0 else 0.0


def _score(field_x, field_y, start, end):
    """Mean of the field along the limb; None where it does not support it."""
    length = math.dist(start, end)
    if length == 0:
        return None
    x, y = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    along = []
    for step in range(10):
        column = round(start[0] + (end[0] - start[0]) * step / 9)
        row = round(start[1] + (end[1] - start[1]) * step / 9)
        along.append(field_x[row][column] * x + field_y[row][column] * y)
    return sum(along) / 10 if sum(value > 0.05 for value in along) >= 7 else None


def _add(skeletons, a, b):
    with_a = next((one for one in skeletons if one.get(a[0]) == a[1]), None)
    with_b = next((one for one in skeletons if one.get(b[0]) == b[1]), None)
    if with_a is None and with_b is None:
        skeletons.append(dict([a, b]))
    elif with_b is None:
        with_a.setdefault(*b)
    elif with_a is None:
        with_b.setdefault(*a)
    elif with_a is not with_b and not set(with_a) & set(with_b):
        with_a.update(with_b)
        skeletons.remove(with_b)
