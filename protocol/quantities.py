"""The types of numbers in messages and configurations: each is finite and within bounds.

msgspec checks the bounds of everything that it decodes, and names the field in its error. A comparison with NaN is
false, so a number with a bound on each side is neither NaN nor infinite. No field of a message is a plain `float`
(tests/protocol/test_quantities.py), and arrays have bounds of the same kind, `protocol.arrays.Elements`.
"""

import math
from typing import Annotated, TypeAlias

from msgspec import Meta

FARTHEST_IN_SCENE = 1e4
"""Metres from the world's origin, along each axis. Beyond, single precision is coarser than a millimetre."""

_MOST_TURNS = 1e6
"""Radians. A yaw may exceed a turn; the sine of an angle up to this is still exact enough."""

MOST_SECONDS = 1e10
"""Three hundred years: practically for ever, and still a time that every clock can represent."""

Coordinate: TypeAlias = Annotated[float, Meta(ge=-FARTHEST_IN_SCENE, le=FARTHEST_IN_SCENE)]
"""Metres in the world frame."""

Heading: TypeAlias = Annotated[float, Meta(ge=-_MOST_TURNS, le=_MOST_TURNS)]
"""Radians about the vertical."""

JointAngle: TypeAlias = Annotated[float, Meta(ge=-math.pi, le=math.pi)]
"""Radians. No joint turns by more than half a turn."""

Elevation: TypeAlias = Annotated[float, Meta(ge=0.0, le=math.pi / 2)]
"""Radians above the horizon."""

SunStrength: TypeAlias = Annotated[float, Meta(ge=0.0, le=10.0)]
"""In units of a clear day's sun."""

ArmLengths: TypeAlias = Annotated[float, Meta(ge=-10.0, le=10.0)]
"""In units of the arm's length; for a point out of reach, the arm points towards it."""

FocalLength: TypeAlias = Annotated[float, Meta(ge=1e-3, le=1e6)]
"""Pixels."""

PixelCoordinate: TypeAlias = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""Pixels from the centre of the picture's first pixel."""

Seconds: TypeAlias = Annotated[float, Meta(ge=0.0, le=MOST_SECONDS)]
"""A duration in seconds."""

Measured: TypeAlias = Annotated[float, Meta(ge=-MOST_SECONDS, le=MOST_SECONDS)]
"""Seconds as a difference of two clocks; a very short duration may be measured as negative."""

Interval: TypeAlias = Annotated[float, Meta(gt=0.0, le=MOST_SECONDS)]
"""Seconds between two events."""

Tally: TypeAlias = Annotated[int, Meta(ge=0)]
"""A count."""

Factor: TypeAlias = Annotated[float, Meta(ge=0.0, le=1e6)]
"""A fitted factor."""

Seed: TypeAlias = Annotated[int, Meta(ge=0, le=2**63 - 1)]
"""A seed of NumPy's random generators."""
