"""The arrays with a row for each of the 18 joints in messages: their shapes and the bounds of their elements."""

from typing import Annotated, TypeAlias

from protocol.arrays import BoolArray, Elements, Float32Array, Float64Array
from protocol.skeleton import JOINT_COUNT

FARTHEST = 1e6
"""The largest coordinate of a joint or a filter, in metres from the world's origin."""

MOST_VARIANCE = FARTHEST**2
"""The largest variance, in m²: that of a joint that may be anywhere."""

EVIDENCE_SIZE = 7
"""Number of statistics of the depths in a window."""

_ROUNDED_UP = 1.0 + 1e-9
"""The bound of a share, or a mean of shares, which by rounding may be a little more than 1."""

JointFlags: TypeAlias = Annotated[BoolArray, Elements((JOINT_COUNT,))]
JointTruth: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT, 3), -FARTHEST, FARTHEST)]
JointQuality: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT,), 0.0, _ROUNDED_UP)]

# NaN stands where a joint was not detected or not located.
JointPixels: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT, 2), or_nan=True)]
JointPoints: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT, 3), or_nan=True)]
JointMetres: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT,), lowest=0.0, or_nan=True)]
JointVariance: TypeAlias = Annotated[Float64Array, Elements((JOINT_COUNT, 3), lowest=0.0, or_nan=True)]
JointEvidence: TypeAlias = Annotated[Float32Array, Elements((JOINT_COUNT, EVIDENCE_SIZE), or_nan=True)]
