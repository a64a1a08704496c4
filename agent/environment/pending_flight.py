"""A flight that waits for its pose estimate."""

from msgspec import Struct

from agent.environment.flight import Flight, camera_of, with_estimate
from agent.environment.sensor import Sensor
from agent.environment.stages import StageTimes, times_of
from protocol.client.pending import Pending
from protocol.config import EnvironmentConfig
from protocol.pose_estimate import PoseEstimate


class PendingFlight(Struct, frozen=True, eq=False):
    """A flight and the pose estimate that it waits for, if any."""

    flight: Flight
    estimate: Pending[PoseEstimate] | None = None

    def finished(self) -> tuple[Flight, StageTimes]:
        """The flight with its estimate, and the seconds that each stage of it took.

        Raises:
            CallFailed: the estimate did not come.
        """
        if self.estimate is None:
            return self.flight, StageTimes({})
        return with_estimate(self.flight, self.estimate.result()), times_of(self.estimate)


def request_estimate(flight: Flight, sensor: Sensor, config: EnvironmentConfig) -> PendingFlight:
    """Request the pose estimate of a flight, unless the flight ended badly."""
    if flight.ended_badly:
        return PendingFlight(flight)
    return PendingFlight(flight, sensor.observe(flight.scene, camera_of(config, flight), flight.filter))
