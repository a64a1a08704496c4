"""The examples in docstrings work as they stand, on workers at the addresses that they name."""

import doctest
import importlib
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from protocol.messages import Observe, Role, Sampled, SampleScene
from tests.agent.analytic_sensor import AnalyticSensor, observe
from tests.serving import serving

ROOT = Path(__file__).parents[1]
ROOMS = ("protocol", "render_worker", "perception_worker", "agent", "orchestrator")
SLOW = {"perception_worker.perceive", "render_worker.renderer"}
"""They need the pose network's file, or OpenGL and the bodies' file."""

CALLED = {
    "agent.environment.hover": ["Hover"],
    "perception_worker.perceive": ["Perceiver"],
    "protocol.client.client": ["Client"],
    "protocol.client.pool": ["Pool"],
    "protocol.config_file": ["load_config"],
    "protocol.server.server": ["serve"],
    "render_worker.renderer": ["open_renderer"],
}
"""The names that every user calls; each has an example."""


def modules_with_examples() -> list[str]:
    found = [path for room in ROOMS for path in (ROOT / room).rglob("*.py") if ">>> " in path.read_text()]
    return sorted(".".join(path.relative_to(ROOT).with_suffix("").parts) for path in found)


MODULES = [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in modules_with_examples()]


@pytest.fixture
def workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Two render workers and a perception worker without pictures, in a working directory of their own."""
    monkeypatch.chdir(tmp_path)
    sensor = AnalyticSensor()
    scenes = {SampleScene: lambda asked: Sampled(scene=sensor.sample(asked.seed, asked.split))}
    estimates = {Observe: lambda asked: observe(asked.scene, asked.camera, asked.filter)}
    with ExitStack() as open_:
        for address in ("ipc://render-0", "ipc://render-1"):
            open_.enter_context(serving(scenes, address, role=Role.RENDER))
        open_.enter_context(serving(estimates, "ipc://perception-0", role=Role.PERCEPTION))
        yield


@pytest.mark.usefixtures("workers")
@pytest.mark.parametrize("module", MODULES)
def test_every_example_of_a_module_works(module: str) -> None:
    done = doctest.testmod(importlib.import_module(module), optionflags=doctest.ELLIPSIS)
    assert done.attempted > 0, "the text has a prompt in it and no example"
    assert done.failed == 0, "see the captured output"


@pytest.mark.parametrize(("module", "names"), CALLED.items(), ids=CALLED)
def test_what_a_user_calls_has_an_example(module: str, names: list[str]) -> None:
    room = importlib.import_module(module)
    without = [name for name in names if not doctest.DocTestParser().get_examples(getattr(room, name).__doc__)]
    assert without == []
