"""The types of configured numbers: finite, and within what a machine can do (see `protocol.quantities`)."""

from typing import Annotated, TypeAlias

from msgspec import Meta

_MOST = 1e6
"""The bound of numbers without a bound of their own; a product of two such numbers is still far from infinite."""

Positive: TypeAlias = Annotated[float, Meta(gt=0, le=_MOST)]
NotNegative: TypeAlias = Annotated[float, Meta(ge=0, le=_MOST)]
Negative: TypeAlias = Annotated[float, Meta(lt=0, ge=-_MOST)]
Fraction: TypeAlias = Annotated[float, Meta(ge=0, le=1)]

Duration: TypeAlias = Annotated[float, Meta(gt=0, le=1e6)]
"""Seconds, eleven days at most: sockets count milliseconds in 32 bits."""

StepDuration: TypeAlias = Annotated[float, Meta(gt=0, le=1e3)]
"""Seconds for which one action is flown."""

Length: TypeAlias = Annotated[float, Meta(gt=0, le=1e3)]
"""Metres of a workspace, which with one step more is well within the coordinates that can be sent."""

Count: TypeAlias = Annotated[int, Meta(ge=1, le=10**12)]
CountOrNone: TypeAlias = Annotated[int, Meta(ge=0, le=2**62)]
EvaluationSeed: TypeAlias = Annotated[int, Meta(ge=0, le=2**62)]

Processes: TypeAlias = Annotated[int, Meta(ge=1, le=256)]
Threads: TypeAlias = Annotated[int, Meta(ge=1, le=1024)]
ThreadsOrNone: TypeAlias = Annotated[int, Meta(ge=0, le=1024)]
InHand: TypeAlias = Annotated[int, Meta(ge=1, le=64)]
"""Requests; a worker's queue holds no more (`Limits.queue`)."""

Drones: TypeAlias = Annotated[int, Meta(ge=1, le=4096)]
Units: TypeAlias = Annotated[int, Meta(ge=1, le=65536)]
"""Of a network's layer."""

LstmLayers: TypeAlias = Annotated[int, Meta(ge=1, le=8)]

ImageSide: TypeAlias = Annotated[int, Meta(ge=64, le=2048, multiple_of=8)]
CameraSide: TypeAlias = Annotated[int, Meta(ge=16, le=8192)]
FieldOfView: TypeAlias = Annotated[float, Meta(gt=1, lt=170)]
"""Degrees."""
