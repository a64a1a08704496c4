"""The two places where a stage is tried, the CPU and the GPU: what a process must be told to use one of them alone."""

import os
from collections.abc import Mapping
from pathlib import Path

from msgspec import Struct

from orchestrator.supervision.launch import PROCESS_ENVIRONMENT

_DRIVER_DIRECTORIES = (
    "/etc/glvnd/egl_vendor.d",
    "/usr/share/glvnd/egl_vendor.d",
    "/usr/local/nvidia/share/glvnd/egl_vendor.d",
)
"""Directories of EGL's drivers; `__EGL_VENDOR_LIBRARY_DIRS`, which EGL reads as well, goes before."""


class Place(Struct, frozen=True):
    """A place where a process computes, and the environment variables for it."""

    name: str
    environment: dict[str, str]


def places(environment: Mapping[str, str]) -> tuple[Place, Place]:
    """The CPU and the GPU of this machine; whether there is a GPU, each process finds out."""
    cpu = {"CUDA_VISIBLE_DEVICES": "", "LIBGL_ALWAYS_SOFTWARE": "1"}
    return (
        Place("CPU", {**PROCESS_ENVIRONMENT, **cpu, **_drawn_by("mesa", environment)}),
        Place("GPU", {**PROCESS_ENVIRONMENT, **_drawn_by("nvidia", environment)}),
    )


def _drawn_by(vendor: str, environment: Mapping[str, str]) -> dict[str, str]:
    """EGL told to take this vendor's driver, if there is one; else it takes the first that works."""
    listed = environment.get("__EGL_VENDOR_LIBRARY_DIRS", "").split(os.pathsep)
    for directory in filter(None, (*listed, *_DRIVER_DIRECTORIES)):
        for file in sorted(Path(directory).glob(f"*{vendor}*.json")):
            return {"__EGL_VENDOR_LIBRARY_FILENAMES": str(file)}
    return {}
