from typing import Any

import msgspec
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.checkpointing.state_tree import join, split
from protocol.errors import ArtifactDamaged, InvalidInput

PLAIN = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text() | st.binary()
NESTED = st.recursive(
    PLAIN,
    lambda inner: st.lists(inner) | st.dictionaries(st.text() | st.integers(0, 9), inner, max_size=5),
    max_leaves=10,
)


@settings(max_examples=50)
@given(st.dictionaries(st.text(), NESTED, max_size=5))
def test_plain_values_come_back(state: dict[str, Any]) -> None:
    assert join(*split(state)) == state


@pytest.mark.parametrize("number", [2**63, 2**64 - 1, 2**64, -(2**63) - 1, 2**127 + 1])
def test_integers_of_any_size_come_back(number: int) -> None:
    assert join(*split({"state": number})) == {"state": number}


@pytest.mark.parametrize(
    "array",
    [
        np.array(3.5),
        np.zeros((0, 3), np.float32),
        np.arange(6, dtype=np.int64).reshape(2, 3).T,
        np.array([True, False]),
        np.array([np.nan, np.inf, -0.0]),
        np.arange(5, dtype=np.uint32),
        torch.tensor(2.0),
        torch.arange(6.0).reshape(2, 3).T,
        torch.tensor([1, 2], dtype=torch.uint8),
        torch.ones(2, requires_grad=True),
    ],
    ids=str,
)
def test_arrays_and_tensors_come_back_as_what_they_were(array) -> None:
    arrays, rest = split({"a": [{"b": array}]})
    assert list(arrays) == ["a.0.b"]
    back = join(arrays, rest)["a"][0]["b"]
    assert type(back) is type(array)
    assert (back.shape, back.dtype) == (array.shape, array.dtype)
    as_numbers = array.detach().numpy() if isinstance(array, torch.Tensor) else array
    assert np.asarray(back).tobytes() == as_numbers.tobytes()


def test_a_tensor_that_came_back_may_be_written_to() -> None:
    back = join(*split({"a": torch.zeros(2)}))
    back["a"].add_(1.0)


def test_two_arrays_of_one_name_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"a\.b"):
        split({"a": {"b": np.zeros(1)}, "a.b": np.zeros(1)})


def test_a_missing_array_is_damage() -> None:
    _, rest = split({"a": np.zeros(1)})
    with pytest.raises(ArtifactDamaged):
        join({}, rest)


@pytest.mark.parametrize("rest", [b"", b"\xc1", msgspec.msgpack.encode(msgspec.msgpack.Ext(3, b"no number"))])
def test_what_is_not_a_state_is_damage(rest: bytes) -> None:
    with pytest.raises(ArtifactDamaged):
        join({}, rest)


def test_objects_have_no_place_in_a_state() -> None:
    with pytest.raises(TypeError):
        split({"a": object()})
