"""A flight that waits for its pose estimate."""

from msgspec import Struct

from agent.environment.flight import Flight, camera_of
from agent.environment.hover_task import HoverTask
from agent.environment.sensor import Sensor
from agent.environment.stages import StageTimes, times_of
from protocol.client.pending import Pending
from protocol.pose_estimate import PoseEstimate


class PendingFlight(Struct, frozen=True, eq=False):
    """A flight and the pose estimate that it waits for, if any."""

    task: HoverTask
    flight: Flight
    estimate: Pending[PoseEstimate] | None = None

    def finished(self) -> tuple[Flight, StageTimes]:
        """The flight with its estimate, and the seconds that each stage of it took.

        Raises:
            CallFailed: the estimate did not come.
        """
        if self.estimate is None:
            return self.flight, StageTimes({})
        return self.task.with_estimate(self.flight, self.estimate.result()), times_of(self.estimate)


def request_estimate(flight: Flight, sensor: Sensor, task: HoverTask) -> PendingFlight:
    """Request the pose estimate of a flight, unless the flight takes no more pictures."""
    if not flight.takes_picture:
        return PendingFlight(task, flight)
    return PendingFlight(task, flight, sensor.observe(flight.scene, camera_of(task.config, flight), flight.filter))
