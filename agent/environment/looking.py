"""A flight and the picture that it waits for."""

from msgspec import Struct

from agent.environment.flight import Flight, camera_of, with_observation
from agent.environment.sensor import Sensor
from agent.environment.stages import StageTimes, times_of
from protocol.client.pending import Pending
from protocol.config import EnvironmentConfig
from protocol.pose_estimate import PoseEstimate


class Looking(Struct, frozen=True, eq=False):
    """A flight and the picture that it waits for, if any."""

    flight: Flight
    look: Pending[PoseEstimate] | None = None

    def landed(self) -> tuple[Flight, StageTimes]:
        """The flight with its picture, and the stages that the picture took.

        Raises:
            CallFailed: the picture did not come.
        """
        if self.look is None:
            return self.flight, StageTimes({})
        return with_observation(self.flight, self.look.result()), times_of(self.look)


def look_from(flight: Flight, sensor: Sensor, config: EnvironmentConfig) -> Looking:
    """Start a flight's picture, unless the flight ended badly."""
    if flight.ended_badly:
        return Looking(flight)
    return Looking(flight, sensor.look(flight.scene, camera_of(config, flight), flight.filter))
