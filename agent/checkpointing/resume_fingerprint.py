"""What of a configuration a training comes to depend on: that much must be the same to go on with it.

Left out are clocks, restarts, numbers of workers, the evaluation, and how long the training is to be, so that a run may
be made longer and moved to a larger machine. Files count by what is in them, so that they may be moved as well.
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
    """Those settings as plain values, nested as in the configuration; checksums of files stand for their paths."""
    settings = msgspec.to_builtins(with_content(config, config.artifacts))
    for name in _OF_NO_MATTER:
        section, _, setting = name.rpartition(".")
        del (settings[section] if section else settings)[setting]
    return settings


def require_same(recorded: dict[str, Any], config: RunConfig, whose: str) -> None:
    """Make sure that `recorded` essentials are this configuration's; settings that it does not know had their defaults.

    Raises:
        OtherConfig: they are not; the message names what differs.
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
    """Whether two paths of unknown content are of one name: before checksums were recorded, folders said nothing."""
    unknown = [path for path in (old, new) if path is not None and not is_checksum(path)]
    return len(unknown) == 2 and Path(unknown[0]).name == Path(unknown[1]).name


def _settings(section: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in section.items():
        if isinstance(value, dict):
            yield from _settings(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
