"""What an experiment measured, as arrays of frames by joints, and the uncertainties that are compared on it."""

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.experiments.figures.bootstrap import IntArray, people_of, samples_of_people
from orchestrator.experiments.figures.columns import LIFTINGS
from protocol.arrays import AnyArray, BoolArray, Float64Array
from protocol.skeleton import JOINT_COUNT

LARGEST_ERROR = 1.0
"""Metres that a clipped error has at most, and that a missing joint counts as where the uncertainty is in metres."""

WRONG, WRONG_OF_LEARNED = 0.15, 0.10
"""Metres; what is farther from the truth counts as wrong for the area under the ROC curve. A learned lifter is held to
the second."""

LEARNED = "learned"
"""The configured lifting of a worker whose lifter places all joints of whoever is found."""

BANDS: Mapping[str, tuple[float, float]] = {
    "all": (0.0, np.inf),
    "under 3 m": (0.0, 3.0),
    "3 to 5 m": (3.0, 5.0),
    "5 to 9 m": (5.0, np.inf),
}
"""By the camera's distance along the ground, the upper end excluded."""


class Sample(Struct, frozen=True, eq=False):
    """Frames with one kind of depth noise.

    Attributes:
        columns: (frames, 18) each, by the table's names; (frames,) those that a frame has one value for. What is true
            or false is 1 or 0; names are left out.
        poses: (frames,) `kinds`, or the family of poses.
        lifting: the configured one.
    """

    columns: Mapping[str, Float64Array]
    poses: AnyArray
    lifting: str

    def __getitem__(self, name: str) -> Float64Array:
        return self.columns[name]

    def __len__(self) -> int:
        return len(self.columns["frame"])

    def of(self, frames: BoolArray) -> "Sample":
        """Some of its frames."""
        columns = {name: values[frames] for name, values in self.columns.items()}
        return replace(self, columns=columns, poses=self.poses[frames])

    def within(self, band: tuple[float, float]) -> "Sample":
        """The frames of a band of distances."""
        return self.of((self["distance"] >= band[0]) & (self["distance"] < band[1]))

    @property
    def learned(self) -> bool:
        """Whether a learned lifter placed its joints."""
        return self.lifting == LEARNED

    @property
    def wrong(self) -> float:
        """Metres beyond which an error of the configured lifting counts as wrong."""
        return WRONG_OF_LEARNED if self.learned else WRONG

    def people(self) -> tuple[IntArray, IntArray]:
        """(frames,) who is in each frame, and samples of these people."""
        person = people_of(self["identity"])
        return person, samples_of_people(int(person.max()) + 1)


def seen_joints(sample: Sample) -> BoolArray:
    """(frames, 18) which joints were detected in the picture and located by the configured lifting."""
    return (sample["detected"] > 0) & np.isfinite(sample["error"])


def inferred_joints(sample: Sample) -> BoolArray:
    """(frames, 18) which joints were located and not detected; a learned lifter alone has any."""
    return ~(sample["detected"] > 0) & np.isfinite(sample["error"])


class Estimates(Struct, frozen=True, eq=False):
    """Joints as estimated in some way, and how unsure each is said to be.

    Attributes:
        uncertainty: (frames, 18), larger is less sure; NaN where a joint has no place.
        points, truth: (frames, 18, 3) metres; points are NaN where a joint has no place.
        missing: the uncertainty that a joint counts as that has no place.
        seen: (frames, 18) which of those with a place were detected, where others have one as well.
        wrong: metres beyond which an error counts as wrong.
    """

    uncertainty: Float64Array
    points: Float64Array
    truth: Float64Array
    missing: float
    seen: BoolArray | None = None
    wrong: float = WRONG

    @property
    def placed(self) -> BoolArray:
        """(frames, 18) which joints have a place and an uncertainty."""
        return np.isfinite(self.uncertainty) & np.all(np.isfinite(self.points), axis=2)

    @property
    def located(self) -> BoolArray:
        """(frames, 18) which of these count as located: not those that were inferred from the others."""
        return self.placed if self.seen is None else self.placed & self.seen

    @property
    def error(self) -> Float64Array:
        """(frames, 18) metres between estimate and truth; NaN where a joint has no place."""
        return np.linalg.norm(self.points - self.truth, axis=2)


def samples_of(table: pa.Table) -> dict[str, Sample]:
    """The frames of a table by their depth noise, in the order of the table's first frames."""
    noises = table["depth_noise"].cast(pa.string()).to_pylist()
    return {noise: _sample(table.filter(pa.array([one == noise for one in noises]))) for noise in dict.fromkeys(noises)}


def _sample(table: pa.Table) -> Sample:
    first_joint = table.schema.get_field_index("joint")
    columns: dict[str, Float64Array] = {}
    for index, name in enumerate(table.column_names):
        kind = table.schema.field(name).type
        if pa.types.is_dictionary(kind):
            continue
        values = table[name].to_numpy()
        by_frame = values.astype(float).reshape(-1, JOINT_COUNT)
        columns[name] = by_frame if index >= first_joint else by_frame[:, 0]
    # Tables that were made before there were families lack the column.
    poses = _names(table, "poses") if "poses" in table.column_names else np.full(len(columns["frame"]), "kinds")
    return Sample(columns, poses, str(_names(table, "lifting")[0]))


def _names(table: pa.Table, column: str) -> AnyArray:
    return np.array(table[column].cast(pa.string()).to_pylist()[::JOINT_COUNT])


def uncertainties(sample: Sample) -> dict[str, Estimates]:
    """All that is compared: the quality under each lifting, its components, and the errors of a calibrated worker.

    Components and quality are taken as 1 - quality, and a missing joint has 1. Components go with the thesis's lifting.
    Expected error and radius go with the configured lifting; a missing joint counts as `LARGEST_ERROR`. Those that a
    learned lifter inferred are not located.
    """
    found = {f"quality, {lifting}": _of_quality(sample, f"quality_{lifting}", lifting) for lifting in LIFTINGS}
    components = (("mass", "mass"), ("height", "height"), ("distance", "distance_quality_mean"))
    found |= {f"{name} alone, mean": _of_quality(sample, column, "mean") for name, column in components}
    for name, column in (("expected error", "expected_error"), ("radius", "radius")):
        if np.isfinite(sample[column]).any():
            points = _points(sample, ("x", "y", "z"))
            found[name] = Estimates(
                sample[column], points, truth_of(sample), LARGEST_ERROR, seen=seen_joints(sample), wrong=sample.wrong
            )
    return found


def truth_of(sample: Sample) -> Float64Array:
    """(frames, 18, 3) metres, the true joints."""
    return _points(sample, ("true_x", "true_y", "true_z"))


def _of_quality(sample: Sample, column: str, lifting: str) -> Estimates:
    points = _points(sample, [f"{axis}_{lifting}" for axis in "xyz"])
    return Estimates(1.0 - sample[column], points, truth_of(sample), missing=1.0)


def _points(sample: Sample, names: Sequence[str]) -> Float64Array:
    return np.stack([sample[name] for name in names], axis=2)
