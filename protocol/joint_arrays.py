"""Arrays with a row for each of the 18 joints, as messages carry them: their shapes, and what their elements may be."""

from typing import Annotated, TypeAlias

from protocol.arrays import BoolArray, Elements, Float32Array, Float64Array
from protocol.skeleton import JOINT_COUNT

FARTHEST = 1e6
"""Metres from the world's origin, beyond which no joint and no filter is."""

MOST_VARIANCE = FARTHEST**2
"""m², of a joint that may be anywhere."""

EVIDENCE_SIZE = 7
"""Numbers that tell of the depths in a window."""

_ROUNDED_UP = 1.0 + 1e-9
"""A share, or a mean of shares, may come to a little more than 1."""

JointFlags: TypeAlias = Annotated[BoolArray, Elements((JOINT_COUNT,))]
JointTruth: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT, 3), -FARTHEST, FARTHEST)]
JointQuality: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT,), 0.0, _ROUNDED_UP)]

# NaN stands where a joint was not detected or not located.
JointPixels: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT, 2), or_nan=True)]
JointPoints: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT, 3), or_nan=True)]
JointMetres: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT,), lowest=0.0, or_nan=True)]
JointVariance: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT, 3), lowest=0.0, or_nan=True)]
JointEvidence: TypeAlias = Annotated[Float32Array, Elements((JOINT_COUNT, EVIDENCE_SIZE), or_nan=True)]
