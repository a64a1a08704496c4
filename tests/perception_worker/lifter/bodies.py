"""A person before a camera, with the depths of a flat body, and a lifter of random weights."""

import numpy as np
from msgspec.structs import replace

from perception_worker.lifter.evidence import evidence_of
from perception_worker.lifter.lifter import Lifter
from perception_worker.lifter.network import Shape
from perception_worker.lifter.stored import Certainty, Provenance, StoredLifter, checksum_of, packed
from perception_worker.networks.network_setting import NetworkSetting
from protocol.camera import Camera, CameraPose, Intrinsics, project
from protocol.skeleton import MIRRORED

SHAPE = Shape(width=16, heads=2, layers=2, hidden=24)
INTRINSICS = Intrinsics.from_horizontal_fov(640, 480, 70.0)
CAMERA = Camera(CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), INTRINSICS)

FACTORS = 1.0 + 0.02 * np.minimum(np.arange(18), MIRRORED)
"""The same for left and right."""

SETTING = NetworkSetting(
    network="some", rows=0, columns=0, look="track", region_rows=176, region_columns=120, peak_threshold=0.1
)


def joints() -> np.ndarray:
    """(18, 3) somebody of 1.7 m at the origin who looks along x."""
    heights = [1.6, 1.45, 1.4, 1.1, 0.9, 1.4, 1.15, 0.95, 0.95, 0.5, 0.1, 0.95, 0.5, 0.1, 1.65, 1.65, 1.62, 1.62]
    sides = [0.0, 0.0, -0.2, -0.25, -0.22, 0.2, 0.28, 0.4, -0.1, -0.1, -0.1, 0.1, 0.12, 0.1, -0.03, 0.03, -0.08, 0.08]
    return np.stack([np.linspace(0.0, 0.1, 18), np.array(sides), np.array(heights)], axis=1)


def weights(seed: int = 0) -> dict[str, np.ndarray]:
    random = np.random.default_rng(seed)
    return {name: (0.2 * random.normal(size=size)).astype(np.float32) for name, size in SHAPE.parameters().items()}


def stored(seed: int = 0) -> StoredLifter:
    kept = packed(weights(seed))
    factors = tuple(FACTORS.tolist())
    return StoredLifter(
        setting=SETTING,
        provenance=Provenance(
            version="0", table="", views="{}", training="{}", frames=1, fitted_on=(1,), calibrated_on=(2,)
        ),
        shape=SHAPE,
        weights=kept,
        checksum=checksum_of(kept),
        seen=Certainty(error=factors, radius=factors),
        inferred=Certainty(error=factors, radius=factors),
        unmeasured=3.0,
    )


def lifter(seed: int = 0) -> Lifter:
    return Lifter(stored(seed))


def picture(camera: Camera = CAMERA, points: np.ndarray | None = None):
    """Keypoints (18, 2), heights (18,), evidence and depth of somebody whose body is as deep as each joint."""
    seen = project(joints() if points is None else points, camera)
    depth = np.full((480, 640), 6.0, np.float32)
    for x, y, far in seen:
        rows, columns = np.ogrid[:480, :640]
        there = np.hypot(rows - y, columns - x) < 9.0
        depth[there] = np.minimum(depth[there], far - 0.05)
    keypoints = seen[:, :2]
    return keypoints, 0.6 * FACTORS, evidence_of(depth, keypoints, camera.intrinsics.fx), depth


def moved(camera: Camera, shift: np.ndarray, turn: float) -> Camera:
    """The camera with the world turned about z and shifted."""
    pose = CameraPose(*(tuple(carried(np.array(end), shift, turn).tolist()) for end in _ends(camera)))
    return replace(camera, pose=pose)


def carried(points: np.ndarray, shift: np.ndarray, turn: float) -> np.ndarray:
    cosine, sine = np.cos(turn), np.sin(turn)
    return points @ np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]).T + shift


def _ends(camera: Camera) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return camera.pose.position, camera.pose.target
