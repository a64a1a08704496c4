"""Clocks are positive and finite, and pauses grow to a bound."""

import math

import msgspec
import pytest

from protocol import Timeouts
from protocol.config import TimeoutsConfig
from protocol.errors import InvalidConfig


@pytest.mark.parametrize("name", Timeouts.__struct_fields__)
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_clock_that_does_not_run_is_refused_by_name(name, value):
    with pytest.raises(InvalidConfig, match=f"timeouts.{name} is {value}"):
        Timeouts(**{name: value})


def test_a_run_configuration_sets_the_three_clocks():
    assert Timeouts.from_config(TimeoutsConfig(call=1.5, startup=2.5, heartbeat=0.25)) == Timeouts(
        call=1.5, startup=2.5, heartbeat=0.25
    )


def test_the_defaults_are_the_configuration_s():
    assert Timeouts.from_config(TimeoutsConfig()) == Timeouts()


def test_a_configuration_has_no_clocks_of_the_transport():
    with pytest.raises(msgspec.ValidationError, match="silence"):
        msgspec.convert({"silence": 1.0}, TimeoutsConfig)


def test_pauses_double_up_to_the_longest():
    timeouts = Timeouts(initial_backoff=0.1, max_backoff=0.5)
    assert [timeouts.backoff(failures) for failures in (1, 2, 3, 4, 5000)] == [0.1, 0.2, 0.4, 0.5, 0.5]
