"""The kinds of number that travel or are configured: each is finite and within bounds, by its type.

msgspec holds whatever it decodes to them, and names the field. A comparison with NaN is false, so a number with a bound
on each side is neither NaN nor infinite. No field that travels is a plain `float` (tests/protocol/test_quantities.py),
and an array's elements have bounds of the same kind, `protocol.arrays.Elements`.
"""

import math
from typing import Annotated, TypeAlias

from msgspec import Meta

FARTHEST_IN_SCENE = 1e4
"""Metres from the world's origin, along each axis. Farther out, single precision is coarser than a millimetre."""

_MOST_TURNS = 1e6
"""Radians. A yaw may go on counting; so many turns still have a sine that is right."""

MOST_SECONDS = 1e10
"""Three hundred years: as good as for ever, and still a time that every clock can be asked for."""

Coordinate: TypeAlias = Annotated[float, Meta(ge=-FARTHEST_IN_SCENE, le=FARTHEST_IN_SCENE)]
"""Metres in the world frame."""

Heading: TypeAlias = Annotated[float, Meta(ge=-_MOST_TURNS, le=_MOST_TURNS)]
"""Radians about the vertical."""

JointAngle: TypeAlias = Annotated[float, Meta(ge=-math.pi, le=math.pi)]
"""Radians. No joint turns by more than half a turn."""

Elevation: TypeAlias = Annotated[float, Meta(ge=0.0, le=math.pi / 2)]
"""Radians above the horizon."""

SunStrength: TypeAlias = Annotated[float, Meta(ge=0.0, le=10.0)]
"""Clear days."""

ArmLengths: TypeAlias = Annotated[float, Meta(ge=-10.0, le=10.0)]
"""Units of an arm's length; what is out of reach is reached for."""

FocalLength: TypeAlias = Annotated[float, Meta(ge=1e-3, le=1e6)]
"""Pixels."""

PixelCoordinate: TypeAlias = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""Pixels from the middle of the picture's first pixel."""

Seconds: TypeAlias = Annotated[float, Meta(ge=0.0, le=MOST_SECONDS)]
"""A time that passes."""

Measured: TypeAlias = Annotated[float, Meta(ge=-MOST_SECONDS, le=MOST_SECONDS)]
"""Seconds as a difference of clocks tells them: what took next to nothing may come out below 0."""

Interval: TypeAlias = Annotated[float, Meta(gt=0.0, le=MOST_SECONDS)]
"""Seconds between two of something."""

Tally: TypeAlias = Annotated[int, Meta(ge=0)]
"""How many, or how much."""

Factor: TypeAlias = Annotated[float, Meta(ge=0.0, le=1e6)]
"""By which something fitted is multiplied."""

Seed: TypeAlias = Annotated[int, Meta(ge=0, le=2**63 - 1)]
"""What NumPy's generators are seeded with."""
