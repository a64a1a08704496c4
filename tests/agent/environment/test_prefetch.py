"""An episode that is begun ahead of time."""

import pytest

from agent.environment.pending_flight import PendingFlight
from agent.environment.prefetch import EpisodePrefetch
from protocol.errors import WorkerLost


class Flights:
    """Begins every episode asked for, after the first few calls have failed."""

    def __init__(self, failures=0):
        self.begun = []
        self._failures = failures

    def begin(self, number):
        if self._failures > 0:
            self._failures -= 1
            raise WorkerLost("nobody is there")
        self.begun.append(number)
        return PendingFlight(task=None, flight=f"flight {number}")


def test_the_episode_that_was_prepared_is_taken_without_beginning_it_again():
    flights = Flights()
    prefetch = EpisodePrefetch()
    prefetch.prepare(4, flights.begin)
    prefetch.prepare(4, flights.begin)
    assert prefetch.take(4, flights.begin).flight == "flight 4"
    assert flights.begun == [4]


def test_what_was_prepared_is_given_away_once():
    flights = Flights()
    prefetch = EpisodePrefetch()
    prefetch.prepare(4, flights.begin)
    assert prefetch.take(4, flights.begin) is not prefetch.take(4, flights.begin)
    assert flights.begun == [4, 4]


def test_another_episode_than_the_prepared_one_is_begun_anew():
    flights = Flights()
    prefetch = EpisodePrefetch()
    prefetch.prepare(4, flights.begin)
    assert prefetch.take(5, flights.begin).flight == "flight 5"


def test_what_is_forgotten_is_not_taken():
    flights = Flights()
    prefetch = EpisodePrefetch()
    prefetch.prepare(4, flights.begin)
    prefetch.forget()
    prefetch.take(4, flights.begin)
    assert flights.begun == [4, 4]


def test_a_worker_that_is_lost_while_it_is_prepared_is_asked_again_in_its_time():
    flights = Flights(failures=1)
    prefetch = EpisodePrefetch()
    prefetch.prepare(4, flights.begin)
    assert prefetch.take(4, flights.begin).flight == "flight 4"


def test_a_worker_that_is_lost_in_its_time_is_told():
    with pytest.raises(WorkerLost):
        EpisodePrefetch().take(4, Flights(failures=1).begin)
