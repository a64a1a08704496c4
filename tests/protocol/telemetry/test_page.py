"""docs/metrics.md lists every metric and endpoint that there is, and no other."""

import re
from pathlib import Path

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.parser import text_string_to_metric_families

from agent.metrics import TrainingMetrics
from orchestrator.monitoring.live_display import Snapshot
from orchestrator.monitoring.metrics import RunCollector
from orchestrator.supervision.heartbeat import Health
from protocol import Pool
from protocol.messages import Pong, Role, State
from protocol.observer import handled
from protocol.records import Progress
from protocol.telemetry.app import telemetry_app
from protocol.telemetry.metrics import RequestMetrics, WorkerCollector, process_registry
from tests.protocol.processes.calls import ask
from tests.protocol.telemetry.test_app import NeverReady
from tests.protocol.workers.scenes import scene_for

PAGE = (Path(__file__).parents[3] / "docs" / "metrics.md").read_text()
PONG = Pong(incarnation="x", state=State.READY, progress=0, queue_depth=0, resident_bytes=1)
PROGRESS = Progress(
    time=1e9, phase="training", step=1, steps=2, episodes=1, steps_per_second=1.0, episode_return=1.0, uncertainty=1.0
)
HEALTH = Health(name="render-0", role=Role.RENDER, pid=1, state="ready")


def every_metric(checkpoints: Path, address: str) -> dict[str, tuple[str, set[str]]]:
    """Type and labels by name, over all that any process has."""
    (checkpoints / "step-000000001").mkdir()
    with Pool([address], role=Role.AGENT, serves=Role.RENDER) as pool:
        registry = process_registry(lambda: True, {Role.RENDER: pool})
        registry.register(WorkerCollector(lambda: PONG))
        registry.register(RunCollector(lambda: Snapshot(activity="", elapsed=0.0, workers=(HEALTH,))))
        training = TrainingMetrics(checkpoints, lambda: 1)
        training.progress(PROGRESS)
        registry.register(training)
        RequestMetrics(registry).count(handled(ask(1), scene_for(1), queue=0.0, compute=0.0))
        families = list(text_string_to_metric_families(generate_latest(registry).decode()))
    return {
        family.name + ("_total" if family.type == "counter" else ""): (
            family.type,
            {label for sample in family.samples for label in sample.labels} - {"le"},
        )
        for family in families
        if not family.name.endswith("_created")
    }


def test_the_page_lists_every_metric_with_its_type_and_labels(tmp_path, address):
    rows = re.findall(r"^\| `(vantage_\w+)` \| (\w+) \| [^|]+ \|([^|]*)\| [^|]+ \|$", PAGE, re.MULTILINE)
    listed = {name: (kind, set(re.findall(r"`(\w+)`", labels))) for name, kind, labels in rows}
    assert listed == every_metric(tmp_path, address)


def test_the_page_lists_every_endpoint():
    paths = set(telemetry_app(NeverReady(), CollectorRegistry()).openapi()["paths"])
    assert set(re.findall(r"^\| `GET (\S+)` \|", PAGE, re.MULTILINE)) == paths | {"/openapi.json"}
