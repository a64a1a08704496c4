"""The state of processes on any machine, by their own HTTP endpoints."""

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
"""The metrics to show, in this order, each summed over its labels."""


class ProcessReport(Struct, frozen=True, kw_only=True):
    """The answers of a process.

    Attributes:
        at: the endpoint that was asked.
        trouble: why there is no readable answer; empty where there is one.
        ready: whether it can do its work.
        waits_for: what it waits for before it is ready.
        figures: its metrics by the names of `_FIGURES`; docs/metrics.md defines each.
    """

    at: str
    trouble: str = ""
    ready: bool = False
    waits_for: tuple[Wait, ...] = ()
    info: Info | None = None
    figures: dict[str, float] = {}


def process_reports(places: Sequence[Endpoint], patience: float = PATIENCE) -> tuple[ProcessReport, ...]:
    """Ask processes in parallel; the reports are in the order of the endpoints."""
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
        return ProcessReport(at=str(at), trouble="no answer in time")
    except httpx.HTTPError as error:
        return ProcessReport(at=str(at), trouble=f"no answer: {error}")
    except (*UNDECODABLE, ValueError) as error:
        return ProcessReport(at=str(at), trouble=f"this is not a Vantage process: {error}")
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
    """One row a process: its role and name, whether it is ready, and its figures."""
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
