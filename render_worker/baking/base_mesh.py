"""MakeHuman's base mesh: which faces are skin, and which are helper geometry that garments and eyes are cut from."""

from pathlib import Path

import numpy as np

from protocol.arrays import Float32Array
from render_worker.arrays import IndexArray
from render_worker.assets import Part

GROUPS: dict[str, tuple[str, ...]] = {
    "skin": ("body",),
    "tights": ("helper-tights",),
    "skirt": ("helper-skirt",),
    "long_hair": ("helper-hair",),
    "left_eye": ("helper-l-eye",),
    "right_eye": ("helper-r-eye",),
    "lashes": ("helper-l-eyelashes-1", "helper-l-eyelashes-2", "helper-r-eyelashes-1", "helper-r-eyelashes-2"),
}
"""Our parts of a person, and the groups of the base mesh that they are made of."""


def read_parts(path: Path) -> dict[str, Part]:
    """Read the base mesh's parts from its Wavefront OBJ file."""
    coordinates, groups = _parse(path.read_text(encoding="utf-8"))
    return {
        name: _weld(np.concatenate([np.array(groups[group]) for group in members]), coordinates)
        for name, members in GROUPS.items()
    }


def _parse(text: str) -> tuple[Float32Array, dict[str, list[list[tuple[int, int]]]]]:
    """Texture coordinates, and for each group its triangles as three (vertex, texture coordinate) pairs."""
    coordinates: list[list[float]] = []
    groups: dict[str, list[list[tuple[int, int]]]] = {}
    group = ""
    for line in text.splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "vt":
            coordinates.append([float(value) for value in rest.split()[:2]])
        elif kind == "g":
            group = rest.strip()
        elif kind == "f":
            corners = [(int(v) - 1, int(t or 1) - 1) for v, _, t in (c.partition("/") for c in rest.split())]
            fan = [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
            groups.setdefault(group, []).extend(fan)
    return np.array(coordinates, np.float32), groups


def _weld(triangles: IndexArray, coordinates: Float32Array) -> Part:
    """Triangles (t, 3, 2) of (vertex, texture coordinate) pairs to one corner for each different pair."""
    corners, index = np.unique(triangles.reshape(-1, 2), axis=0, return_inverse=True)
    return Part(
        source=corners[:, 0].astype(np.int32),
        uv=coordinates[corners[:, 1]],
        triangles=index.reshape(-1, 3).astype(np.int32),
    )
