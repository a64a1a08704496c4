"""Steps a second over networks of some bandwidths, by how frames travel.

    python -m benchmarks.bandwidth

Render worker, perception workers and the client are real processes with keys on three hosts: network namespaces whose
lines are rate limited by `tc`'s `tbf`, each in the direction away from its host. Needs Linux, root, `ip` and `tc`.
Each way in which frames travel has a perception worker of its own; they take turns, so that a disturbance affects all.
A step is one `Observe`, with the filter of the step before; one flight is under way, or four at once.
Prints a Markdown table.
"""

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from pathlib import Path

import msgspec
from msgspec import Struct
from rich.console import Console

from benchmarks.machine import machine_kind
from orchestrator.pictures.view import Viewpoint, camera_at
from protocol import Client, Timeouts
from protocol.camera import Intrinsics
from protocol.client.pending import Pending
from protocol.environment_config import EnvironmentConfig
from protocol.frame import ENCODINGS, Encoding
from protocol.messages import Observe, Render, Role, SampleScene
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.scene import Scene
from protocol.security import Security, load_credentials
from tests.deployment.hosts import Hosts, why_not
from tests.protocol.security.deployment import Deployment

RATES = {"no limit": "", "1 Gbit/s": "1gbit", "100 Mbit/s": "100mbit", "20 Mbit/s": "20mbit"}
BURSTS = {"1gbit": "128kb", "100mbit": "16kb", "20mbit": "8kb"}
"""Bytes that go out at once after a pause: 1 to 3 ms at that rate, so that no small frame passes unlimited."""
FLIGHTS = (1, 4)
RENDER_PORT = 5601
PATIENT = Timeouts(call=60.0, startup=120.0)


class Leg(Struct, frozen=True):
    """Some steps, and what they took.

    Attributes:
        flights: how many were under way at once.
        rate: steps a second.
        way: median seconds that a frame was on its way from renderer to perceiver, packing included.
        packing: median seconds of that to pack and to open.
    """

    encoding: Encoding
    flights: int
    rate: float
    way: float
    packing: float


class Flight:
    """A drone that circles a person, and knows its filter."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._filter = FilterState.initial((*scene.position, EnvironmentConfig().target_height))
        self._steps = 0

    def step(self, perceiver: Client) -> Callable[[], PoseEstimate]:
        """Ask for the next step; what is returned waits for it."""
        view = Viewpoint(distance=2.0 + 0.1 * (self._steps % 20), angle=9.0 * self._steps)
        self._steps += 1
        camera = camera_at(view, self._scene, EnvironmentConfig())
        pending = perceiver.submit(Observe(scene=self._scene, camera=camera, filter=self._filter))
        return lambda: self._take(pending)

    def _take(self, pending: Pending[PoseEstimate]) -> PoseEstimate:
        estimate = pending.result()
        self._filter = estimate.filter
        return estimate


def legs(perceivers: Mapping[Encoding, Client], scenes: Sequence[Scene], seconds: float, longest: int) -> Iterator[Leg]:
    """Fly with each perceiver in turn, one flight and then several at once.

    Args:
        seconds: that a leg is to take; it has three turns at least, and `longest` at most.
    """
    for count in FLIGHTS:
        for encoding, perceiver in perceivers.items():
            flights = [Flight(scene) for scene in scenes[:count]]
            seen: list[PoseEstimate] = []
            begun = time.perf_counter()
            while len(seen) < 3 * count or (time.perf_counter() - begun < seconds and len(seen) < longest * count):
                seen += [wait() for wait in [flight.step(perceiver) for flight in flights]]
            rate = len(seen) / (time.perf_counter() - begun)
            packing = statistics.median(_seconds(one, "pack", "unpack") for one in seen)
            way = statistics.median(_seconds(one, "transport", "pack", "unpack") for one in seen)
            yield Leg(encoding=encoding, flights=count, rate=rate, way=way, packing=packing)


def _seconds(estimate: PoseEstimate, *stages: str) -> float:
    return sum(estimate.timings.get(stage, 0.0) for stage in stages)


def fly(key: Path, addresses: Sequence[str], seconds: float, longest: int) -> list[Leg]:
    """What the third host does.

    Args:
        addresses: the render worker's, then those of a perception worker for each encoding.
    """
    security = Security(load_credentials(key))
    with ExitStack() as opened:

        def client(address: str, serves: Role) -> Client:
            return opened.enter_context(
                Client(address, role=Role.AGENT, serves=serves, timeouts=PATIENT, security=security)
            )

        renderer = client(addresses[0], Role.RENDER)
        perceivers: dict[Encoding, Client] = {
            encoding: client(address, Role.PERCEPTION)
            for encoding, address in zip(ENCODINGS, addresses[1:], strict=True)
        }
        scenes = [renderer.call(SampleScene(seed=seed, split="train")).scene for seed in range(max(FLIGHTS))]
        for scene in scenes:
            # A few pixels are enough for a scene to be made, which a flight does once.
            camera = camera_at(Viewpoint(), scene, EnvironmentConfig())
            small = msgspec.structs.replace(camera, intrinsics=Intrinsics.from_horizontal_fov(16, 12, 70.0))
            renderer.call(Render(scene=scene, camera=small))
        for perceiver in perceivers.values():
            perceiver.wait_ready()
            Flight(scenes[0]).step(perceiver)()
        return list(legs(perceivers, scenes, seconds, longest))


class Deployed:
    """Workers on two hosts and a third one to fly from."""

    def __init__(self, hosts: Hosts, folder: Path) -> None:
        self._hosts = hosts
        self._folder = folder
        self._keys = Deployment(folder / "keys").folder
        at = hosts.addresses
        ports = range(RENDER_PORT + 1, RENDER_PORT + 1 + len(ENCODINGS))
        self._render = f"tcp://{at['gpu-box']}:{RENDER_PORT}"
        self._perception = {
            encoding: f"tcp://{at['jetson']}:{port}" for encoding, port in zip(ENCODINGS, ports, strict=True)
        }

    def start(self) -> None:
        """Start the workers; they get ready by themselves."""
        self._start("gpu-box", "render", "--bind", self._render)
        for encoding, address in self._perception.items():
            self._start("jetson", "perception", "--bind", address, "--render", self._render, "--frames", encoding)

    def limit(self, rate: str) -> None:
        """Limit each host's line to a rate, as `tc` writes it."""
        for host in self._hosts.addresses:
            tbf = ("tbf", "rate", rate, "burst", BURSTS[rate], "latency", "200ms")
            self._hosts.run(host, "tc", "qdisc", "replace", "dev", "eth0", "root", *tbf)

    def fly(self, seconds: float, longest: int) -> list[Leg]:
        """Each way in turn."""
        options = ("--seconds", str(seconds), "--longest", str(longest), "--key", str(self._keys / "agent.key"))
        addresses = (self._render, *self._perception.values())
        command = (sys.executable, "-m", "benchmarks.bandwidth", *options, "--fly", *addresses)
        return msgspec.json.decode(self._hosts.run("trainer", *command), type=list[Leg])

    def _start(self, host: str, role: str, *options: str) -> None:
        log = self._folder / f"{role}{options[1].rpartition(':')[2]}.log"
        command = (sys.executable, "-m", f"{role}_worker", *options, "--key", str(self._keys / f"{role}.key"))
        self._hosts.start(host, *command, log=log, environment={"OMP_NUM_THREADS": "1"})


def measure(rounds: int, seconds: float, longest: int, console: Console) -> dict[str, list[Leg]]:
    """The legs flown at each rate."""
    with (
        tempfile.TemporaryDirectory() as folder,
        closing(Hosts(["gpu-box", "jetson", "trainer"], network="bandwidth")) as hosts,
    ):
        deployed = Deployed(hosts, Path(folder))
        deployed.start()
        flown: dict[str, list[Leg]] = {}
        for name, rate in RATES.items():
            if rate:
                deployed.limit(rate)
            for number in range(rounds):
                console.print(f"{name}, round {number + 1} of {rounds}")
                flown.setdefault(name, []).extend(deployed.fly(seconds, longest))
    return flown


def table(flown: Mapping[str, Sequence[Leg]]) -> str:
    """Medians over the rounds: steps a second, and a frame's way."""
    head = "| bandwidth | frames | steps/s, 1 flight | steps/s, 4 flights | a frame's way, ms | of it packing, ms |"
    rows = [
        f"| {rate} | {encoding} | {_median(legs, encoding, 1, 'rate'):.1f} | {_median(legs, encoding, 4, 'rate'):.1f} "
        f"| {1e3 * _median(legs, encoding, 1, 'way'):.1f} | {1e3 * _median(legs, encoding, 1, 'packing'):.1f} |"
        for rate, legs in flown.items()
        for encoding in ENCODINGS
    ]
    return "\n".join([head, "|---|---|---:|---:|---:|---:|", *rows])


def _median(legs: Sequence[Leg], encoding: Encoding, flights: int, name: str) -> float:
    chosen = [leg for leg in legs if (leg.encoding, leg.flights) == (encoding, flights)]
    return statistics.median(getattr(leg, name) for leg in chosen)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bandwidth", description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=2.0, help="that each way takes in a round, about")
    parser.add_argument("--longest", type=int, default=40, help="steps of a flight that it takes at most")
    parser.add_argument("--fly", nargs="+", metavar="ADDRESS", help=argparse.SUPPRESS)
    parser.add_argument("--key", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.fly:
        sys.stdout.buffer.write(msgspec.json.encode(fly(options.key, options.fly, options.seconds, options.longest)))
        return
    if (reason := why_not()) is not None:
        parser.error(reason)
    flown = measure(options.rounds, options.seconds, options.longest, Console(stderr=True))
    console = Console(soft_wrap=True)
    console.print(f"machine: {machine_kind()}; {options.rounds} rounds", markup=False)
    console.print(table(flown), markup=False)


if __name__ == "__main__":
    main()
