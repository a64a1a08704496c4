"""The findings as Markdown."""

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct

from benchmarks.accelerator.differences import Difference
from benchmarks.accelerator.jobs import Missing
from benchmarks.accelerator.measured import Measured
from orchestrator.monitoring.report import TrainingReport

_SEEN: Mapping[str, tuple[str, ...]] = {
    "infer": ("heatmaps",),
    "decode": ("keypoints",),
    "lift": ("points",),
    "qoe": ("quality",),
    "filter": ("filter_mean", "filter_variance"),
}

COMES_OUT: Mapping[str, tuple[str, ...]] = {
    "render": ("rgb", "depth"),
    "learn, one update": ("weights",),
    **{
        f"{stage}, {look}": tuple(f"{look}/{name}" for name in names)
        for look in ("track", "whole")
        for stage, names in _SEEN.items()
    },
}
"""The arrays of each stage, by name; perception's stages have one set for each detector."""

ALWAYS_ON_CPU = ("decode", "lift", "qoe", "filter")
"""Stages that only the CPU does, whatever the network runs on."""


class Row(Struct, frozen=True):
    """The results of a trial at a place, and of its repetition in another process; `note` follows its stages' names."""

    name: str
    title: str
    note: str
    place: str
    found: Measured | Missing
    again: Measured | Missing


def stage_table(rows: Sequence[Row]) -> str:
    """Milliseconds of each stage, and whether another process got the same bytes."""
    head = [
        "| stage | on | median, ms | 99th percentile, ms | same bytes again |",
        "|---|---|---:|---:|---|",
    ]
    return "\n".join([*head, *(line for row in rows for line in _stage_lines(row))])


def _stage_lines(row: Row) -> list[str]:
    if isinstance(row.found, Missing):
        return [f"| {row.title} | {row.place}: not measured, {row.found.reason} | | | |"]
    return [
        f"| {stage}{row.note} | {row.place}: {row.found.device} | {1e3 * np.median(seconds):.2f} | "
        f"{1e3 * np.quantile(seconds, 0.99):.2f} | {_same(stage, row)} |"
        for stage, seconds in row.found.seconds.items()
        if row.place == "CPU" or not stage.startswith(ALWAYS_ON_CPU)
    ]


def _same(stage: str, row: Row) -> str:
    names = COMES_OUT.get(stage)
    if names is None or isinstance(row.found, Missing):
        return ""
    if isinstance(row.again, Missing):
        return f"not tried: {row.again.reason}"
    own, again = row.found.digests, row.again.digests
    other = [name for name in names if own[name] != again[name]]
    return f"no: {', '.join(other)}" if other else "yes"


def difference_table(found: Mapping[str, Sequence[Difference]]) -> str:
    """Differences of results, a row for each comparison."""
    head = [
        "| against the CPU's | quantity | median | largest | share that differs | only one has |",
        "|---|---|---:|---:|---:|---:|",
    ]
    rows = [
        f"| {title} | {one.quantity} | {one.median:.3g} | {one.largest:.3g} | {one.unequal:.2%} | {one.one_sided} |"
        for title, differences in found.items()
        for one in differences
    ]
    return "\n".join([*head, *rows])


def loop_table(found: Mapping[str, TrainingReport | Missing]) -> str:
    """Steps a second of trainings, and the median milliseconds of their stages."""
    head = ["| place | steps/s | stages in the loop, ms |", "|---|---:|---|"]
    return "\n".join([*head, *(_loop_line(place, one) for place, one in found.items())])


def _loop_line(place: str, report: TrainingReport | Missing) -> str:
    if isinstance(report, Missing):
        return f"| {place} | | not measured: {report.reason} |"
    stages = ", ".join(
        f"{stage} {1e3 * seconds:.2f}" for stage, seconds in report.stages.items() if seconds is not None
    )
    return f"| {place} | {report.steps_per_second:.2f} | {stages} |"


def missing_gpu(rows: Sequence[Row]) -> str | None:
    """One sentence of what a GPU was not there for; none where it was there for all."""
    missing: dict[str, str] = {}
    for row in rows:
        if row.place == "GPU" and isinstance(row.found, Missing):
            missing.setdefault(row.title.split()[0], row.found.reason)
    if not missing:
        return None
    return "No GPU was measured for all of it: " + "; ".join(f"{kind}, {why}" for kind, why in missing.items()) + "."
