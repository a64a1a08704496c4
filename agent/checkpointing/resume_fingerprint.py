"""The settings that a training's result depends on: they must be the same to resume it.

Left out are clocks, restarts, numbers of workers, the evaluation, and the length of the training, so that a run may be
made longer and moved to a larger machine. Files count by their content, so that they may be moved as well.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from agent.errors import OtherConfig
from protocol.config import RunConfig
from protocol.named_files import is_checksum, path_settings, with_content

_OF_NO_MATTER = (
    "timeouts",
    "supervision",
    "evaluation",
    "render.workers",
    "perception.workers",
    "perception.prefetch",
    "training.steps",
    "training.log_every",
    "training.checkpoint_every",
    "training.keep_checkpoints",
    "artifacts",
)


def fingerprint(config: RunConfig) -> dict[str, Any]:
    """The settings that matter, as plain values nested as in the configuration; checksums stand for paths of files."""
    settings = msgspec.to_builtins(with_content(config, config.artifacts))
    for name in _OF_NO_MATTER:
        section, _, setting = name.rpartition(".")
        del (settings[section] if section else settings)[setting]
    return settings


def require_same(recorded: dict[str, Any], config: RunConfig, whose: str) -> None:
    """Make sure that a recorded fingerprint is this configuration's; settings missing from it had their defaults.

    Raises:
        OtherConfig: it is not; the message names the differences.
    """
    try:
        before = fingerprint(msgspec.convert(recorded, RunConfig))
    except msgspec.ValidationError as error:
        raise OtherConfig(f"{whose} is of another configuration: {error}") from error
    paths = {setting.name for setting in path_settings(config)}
    differing = [
        f"{name} was {old!r}, is {new!r}"
        for (name, old), (_, new) in zip(_settings(before), _settings(fingerprint(config)), strict=True)
        if old != new and not (name in paths and _may_be_same(old, new))
    ]
    if differing:
        raise OtherConfig(f"{whose} is of another configuration: {'; '.join(differing)}")


def _may_be_same(old: str | None, new: str | None) -> bool:
    """Whether two paths of unknown content have the same file name: older versions recorded no checksums."""
    unknown = [path for path in (old, new) if path is not None and not is_checksum(path)]
    return len(unknown) == 2 and Path(unknown[0]).name == Path(unknown[1]).name


def _settings(section: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in section.items():
        if isinstance(value, dict):
            yield from _settings(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
