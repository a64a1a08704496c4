"""An episode that is taken off ahead of time."""

import pytest

from agent.environment.looking import Looking
from agent.environment.upcoming import Upcoming
from protocol.errors import WorkerLost


class Flights:
    """Takes off whatever it is asked for, but for as many times as it is told to fail."""

    def __init__(self, failures=0):
        self.begun = []
        self._failures = failures

    def begin(self, number):
        if self._failures > 0:
            self._failures -= 1
            raise WorkerLost("nobody is there")
        self.begun.append(number)
        return Looking(flight=f"flight {number}")


def test_the_episode_that_was_prepared_is_taken_without_another_take_off():
    flights = Flights()
    upcoming = Upcoming()
    upcoming.prepare(4, flights.begin)
    upcoming.prepare(4, flights.begin)
    assert upcoming.take(4, flights.begin).flight == "flight 4"
    assert flights.begun == [4]


def test_what_was_prepared_is_given_away_once():
    flights = Flights()
    upcoming = Upcoming()
    upcoming.prepare(4, flights.begin)
    assert upcoming.take(4, flights.begin) is not upcoming.take(4, flights.begin)
    assert flights.begun == [4, 4]


def test_another_episode_than_the_prepared_one_is_taken_off_anew():
    flights = Flights()
    upcoming = Upcoming()
    upcoming.prepare(4, flights.begin)
    assert upcoming.take(5, flights.begin).flight == "flight 5"


def test_what_is_forgotten_is_not_taken():
    flights = Flights()
    upcoming = Upcoming()
    upcoming.prepare(4, flights.begin)
    upcoming.forget()
    upcoming.take(4, flights.begin)
    assert flights.begun == [4, 4]


def test_a_worker_that_is_lost_while_it_is_prepared_is_asked_again_in_its_time():
    flights = Flights(failures=1)
    upcoming = Upcoming()
    upcoming.prepare(4, flights.begin)
    assert upcoming.take(4, flights.begin).flight == "flight 4"


def test_a_worker_that_is_lost_in_its_time_is_told():
    with pytest.raises(WorkerLost):
        Upcoming().take(4, Flights(failures=1).begin)
