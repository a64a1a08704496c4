import math

import numpy as np
import pytest
from msgspec.structs import replace

from protocol.codec import decode, encode, open_envelope, seal
from protocol.errors import ImpossibleValue
from protocol.header import RequestHeader
from protocol.limits import Limits
from protocol.messages import Observe, Perceive
from protocol.pose_estimate import FilterState
from tests.protocol.values.samples import CAMERA, SCENE, picture


def test_a_new_filter_knows_nothing_and_expects_everybody_at_its_mean():
    state = FilterState.initial((1.0, 2.0, 3.0))
    assert (state.mean == (1.0, 2.0, 3.0)).all()
    assert (state.variance == 1.0).all()
    assert (state.process_noise == 0.01).all()
    assert not state.seen.any()


def test_a_filter_of_another_skeleton_is_refused():
    with pytest.raises(ValueError, match=r"mean has shape \(17, 3\)"):
        FilterState(
            mean=np.zeros((17, 3)), variance=np.ones((18, 3)), process_noise=np.ones(18), seen=np.zeros(18, bool)
        )


WRONG = [
    ("mean", math.nan),
    ("mean", math.inf),
    ("mean", -1e300),
    ("variance", math.nan),
    ("variance", math.inf),
    ("variance", -1e-9),
    ("process_noise", math.nan),
    ("process_noise", -math.inf),
    ("process_noise", -0.01),
]


def wrong(name: str, value: float) -> np.ndarray:
    array = getattr(FilterState.initial(), name).copy()
    array.flat[-1] = value
    return array


@pytest.mark.parametrize(("name", "value"), WRONG)
def test_a_filter_that_no_scene_has_is_refused(name, value):
    with pytest.raises(ValueError, match=rf"{name}\[.*it must be finite"):
        replace(FilterState.initial(), **{name: wrong(name, value)})


@pytest.mark.parametrize(("name", "value"), WRONG)
@pytest.mark.parametrize("kind", [Observe, Perceive])
def test_from_a_client_that_does_not_look_it_is_refused_by_name(name, value, kind):
    """The arrays of a filter come behind those of a frame: mean, variance, process noise, seen."""
    what = {"frame": picture()} if kind is Perceive else {"scene": SCENE, "camera": CAMERA}
    parts = seal(
        encode(kind(filter=FilterState.initial(), **what), Limits()),
        RequestHeader(request=1, incarnation="a", deadline=1.0),
    )
    place = len(parts) - 4 + ("mean", "variance", "process_noise").index(name)
    parts[place] = wrong(name, value).tobytes()
    with pytest.raises(ImpossibleValue, match=rf"{name}\[.*it must be finite"):
        decode(open_envelope(parts, Limits()), Limits())
