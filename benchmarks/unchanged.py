"""Whether a profile's estimates are another checkout's, bit for bit.

    python -m benchmarks.unchanged --against ../before --frames 200 --profile thesis

Render and perception workers of both checkouts run as processes and get the same requests: test scenes from all around,
1.5 to 9 m away, a few pictures of each, the filter carried on, with both kinds of depth noise in turns. Every field
of an estimate is compared except its timings.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import islice
from pathlib import Path

import numpy as np
from msgspec.structs import asdict, replace
from rich.console import Console
from rich.progress import track

from benchmarks.estimation.viewpoints import all_views
from benchmarks.machine import machine_kind
from orchestrator.pictures.view import a_step_before, camera_at
from protocol import Client, Timeouts
from protocol.config import RunConfig
from protocol.messages import Observe, Role, SampleScene
from protocol.pose_estimate import FilterState, PoseEstimate

OWN = Path(__file__).resolve().parents[1]
PICTURES = 4
"""Of each scene, a step apart."""

_PATIENCE = Timeouts(call=60.0, startup=120.0)


class CheckoutWorkers:
    """A render and a perception worker of one checkout."""

    def __init__(self, renderer: Client, perceiver: Client) -> None:
        self.renderer = renderer
        self.perceiver = perceiver


@contextmanager
def workers_of(checkout: Path, config: Path, directory: Path) -> Generator[CheckoutWorkers]:
    """CheckoutWorkers that run the rooms of a checkout, by this interpreter."""
    render, perception = (f"ipc://{directory}/{role}" for role in ("render", "perception"))
    environment = {**os.environ, "PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1"}
    with ExitStack() as held:
        for module, *arguments in (
            ("render_worker", "--bind", render),
            ("perception_worker", "--bind", perception, "--render", render),
        ):
            command = [sys.executable, "-m", module, *arguments, "--config", str(config)]
            process = held.enter_context(
                subprocess.Popen(command, cwd=checkout, env=environment, stderr=subprocess.DEVNULL)
            )
            held.callback(process.terminate)
        clients = [
            held.enter_context(Client(address, role=Role.AGENT, serves=serves, timeouts=_PATIENCE))
            for address, serves in ((render, Role.RENDER), (perception, Role.PERCEPTION))
        ]
        for client in clients:
            client.wait_ready()
        yield CheckoutWorkers(*clients)


def requests(renderer: Client, frames: int, config: RunConfig) -> Iterator[Observe]:
    """Pictures of scenes, a step apart, each scene from its first one on."""
    rng, environment = np.random.default_rng(0), config.environment
    for seed, viewpoint in zip(range(-(-frames // PICTURES)), all_views(seed=0, farthest=9.0), strict=False):
        scene = renderer.call(SampleScene(seed=seed, split="test")).scene
        camera = replace(camera_at(viewpoint, scene, environment), depth_noise=("none", "d435i")[seed % 2])
        initial = FilterState.initial((0.0, 0.0, environment.target_height))
        for _ in range(PICTURES):
            yield Observe(scene=scene, camera=camera, filter=initial, truth=True, heatmaps=True)
            camera = a_step_before(camera, environment, rng)


def differences(one: PoseEstimate, other: PoseEstimate) -> list[str]:
    """The names of the fields in which two estimates differ, to the bit."""
    here, there = _flat(asdict(one)), _flat(asdict(other))
    return sorted(name for name in here.keys() | there.keys() if here.get(name) != there.get(name))


def _flat(values: dict[str, object], prefix: str = "") -> dict[str, object]:
    flat: dict[str, object] = {}
    for name, value in values.items():
        if isinstance(value, FilterState):
            flat |= _flat(asdict(value), f"{name}.")
        elif isinstance(value, np.ndarray):
            flat[prefix + name] = (value.dtype.str, value.shape, value.tobytes())
        elif name != "timings":
            flat[prefix + name] = value
    return flat


def compare(ours: CheckoutWorkers, theirs: CheckoutWorkers, asked: Iterator[Observe]) -> Iterator[list[str]]:
    """The fields that differ in each estimate, requested from both with the filter after their last."""
    filter_states: list[FilterState] = []
    for number, request in enumerate(asked):
        if number % PICTURES == 0:
            filter_states = [request.filter] * 2
        seen = [
            workers.perceiver.call(replace(request, filter=filter_state))
            for workers, filter_state in zip((ours, theirs), filter_states, strict=True)
        ]
        filter_states = [one.filter for one in seen]
        yield differences(*seen)


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare and print; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.unchanged",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--against", type=Path, required=True, metavar="DIR", help="another checkout")
    parser.add_argument("--frames", type=int, default=200, help="pictures (default: %(default)s)")
    parser.add_argument("--profile", choices=["thesis", "vantage"], default="thesis")
    options = parser.parse_args(arguments)
    console = Console(soft_wrap=True)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as held:
        directory = Path(folder)
        config = directory / "config.toml"
        config.write_text(f'profile = "{options.profile}"\n')
        pair: list[CheckoutWorkers] = []
        for name, checkout in (("ours", OWN), ("theirs", options.against.resolve())):
            (directory / name).mkdir()
            pair.append(held.enter_context(workers_of(checkout, config, directory / name)))
        asked = islice(requests(pair[0].renderer, options.frames, RunConfig()), options.frames)
        compared = compare(pair[0], pair[1], asked)
        found = list(track(compared, "comparing", options.frames, console=Console(stderr=True)))
    changed = [one for one in found if one]
    console.print(f"machine: {machine_kind()}", markup=False)
    console.print(f"{len(found)} pictures, profile {options.profile}: {len(changed)} estimates differ", markup=False)
    for one in changed[:5]:
        console.print(f"in {', '.join(one)}", markup=False)
    return 1 if changed else 0


if __name__ == "__main__":
    sys.exit(main())
