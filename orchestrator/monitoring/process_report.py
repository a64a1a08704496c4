"""What processes say of themselves over HTTP, on whichever machine: the other way to ask how a run is."""

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import httpx
import msgspec
from msgspec import Struct
from prometheus_client.parser import text_string_to_metric_families
from rich.table import Table
from rich.text import Text

from protocol.telemetry.endpoint import Endpoint
from protocol.telemetry.info import Info
from protocol.telemetry.readiness import Readiness, Wait
from protocol.text import UNDECODABLE

PATIENCE = 3.0
"""Seconds to wait for each answer."""

_FIGURES = {
    "vantage_environment_steps_total": "steps",
    "vantage_episodes_total": "episodes",
    "vantage_episode_return": "return",
    "vantage_uncertainty": "uncertainty",
    "vantage_steps_per_second": "steps/s",
    "vantage_checkpoint_age_seconds": "checkpoint age, s",
    "vantage_requests_total": "requests",
    "vantage_requests_in_flight": "in flight",
    "vantage_restarts_total": "restarts",
    "vantage_process_resident_memory_bytes": "memory, bytes",
}
"""The metrics that are shown, in this order, each summed over its labels."""


class ProcessReport(Struct, frozen=True, kw_only=True):
    """A process, as it answered.

    Attributes:
        at: where it was asked.
        trouble: why there is no answer, or none that can be read; empty where there is one.
        ready: whether it can do its work.
        waits_for: what it waits for until it can.
        figures: see docs/metrics.md for what stands behind each.
    """

    at: str
    trouble: str = ""
    ready: bool = False
    waits_for: tuple[Wait, ...] = ()
    info: Info | None = None
    figures: dict[str, float] = {}


def process_reports(places: Sequence[Endpoint], patience: float = PATIENCE) -> tuple[ProcessReport, ...]:
    """Ask processes how they are, side by side; the reports come in the places' order."""
    with (
        httpx.Client(timeout=patience, trust_env=False) as client,
        ThreadPoolExecutor(max_workers=max(1, len(places))) as threads,
    ):
        return tuple(threads.map(lambda at: _report(client, at), places))


def _report(client: httpx.Client, at: Endpoint) -> ProcessReport:
    try:
        info = msgspec.json.decode(_get(client, at, "/info"), type=Info)
        readiness = msgspec.json.decode(_get(client, at, "/health/ready"), type=Readiness)
        figures = _figures(_get(client, at, "/metrics").decode())
    except httpx.TimeoutException:
        return ProcessReport(at=str(at), trouble="it took too long to answer")
    except httpx.HTTPError as error:
        return ProcessReport(at=str(at), trouble=f"nobody answers: {error}")
    except (*UNDECODABLE, ValueError) as error:
        return ProcessReport(at=str(at), trouble=f"this is no process of ours: {error}")
    return ProcessReport(at=str(at), ready=readiness.ready, waits_for=readiness.waits_for, info=info, figures=figures)


def _get(client: httpx.Client, at: Endpoint, path: str) -> bytes:
    return client.get(f"http://{at}{path}").content


def _figures(exposition: str) -> dict[str, float]:
    sums: dict[str, float] = {}
    for family in text_string_to_metric_families(exposition):
        for sample in family.samples:
            sums[sample.name] = sums.get(sample.name, 0.0) + sample.value
    return {shown: sums[name] for name, shown in _FIGURES.items() if name in sums}


def reports_table(reports: Iterable[ProcessReport]) -> Table:
    """One row a process: who it is, whether it is ready, and its figures."""
    table = Table("at", "role", "name", "is", "figures", box=None, header_style="dim", pad_edge=False)
    for report in reports:
        role, name = (report.info.role, report.info.name) if report.info else ("", "")
        table.add_row(report.at, role, name, _standing(report), _in_words(report.figures))
    return table


def _standing(report: ProcessReport) -> Text:
    if report.trouble:
        return Text(report.trouble, "bold red")
    if report.ready:
        return Text("ready", "green")
    return Text("waits for " + "; ".join(f"{wait.on} ({wait.reason})" for wait in report.waits_for), "yellow")


def _in_words(figures: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {value:.6g}" for name, value in figures.items())
