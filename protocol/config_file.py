"""A configuration's file: one that a user wrote, or a resolved one that the orchestrator wrote for a run.

A resolved configuration has every setting, absolute paths, and the checksums of its files. A setting that it lacks was
lost, and a run does not resume with a file that has changed.
"""

import tomllib
from pathlib import Path
from typing import Annotated, Any, cast

import msgspec
from msgspec import Meta, Struct
from msgspec.structs import replace

from protocol.config import RunConfig, settled
from protocol.errors import InvalidConfig
from protocol.named_files import (
    checksums_of,
    relative_paths,
    require_same_files,
    with_absolute_paths,
    with_content,
)
from protocol.renamed_settings import renamed_in
from protocol.text import UNDECODABLE, NotUtf8, utf8_text
from protocol.whole_record import lacking

_RESOLVED = "resolved"
"""The table in a configuration that marks it as resolved."""

_FORMAT = 3

_CAME_AFTER: dict[int, frozenset[str]] = {
    0: frozenset({"render.prefetch", "artifacts"}),
    1: frozenset({"env_id", "grid", "learner.recurrent_ppo"}),
    2: frozenset({"hover"}),
}
"""Settings that are newer than a format, and whose defaults change no result of a configuration without them.

Other newer settings are never guessed. Before the first format, resolved configurations had no mark.
"""

_MOST_NAMED = 5
"""Number of settings that a message names."""


class _Resolved(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The mark.

    Attributes:
        format: of the resolved configuration.
        left_out: the settings that are None, which TOML can't express; all others are written.
    """

    format: Annotated[int, Meta(ge=1)]
    left_out: tuple[str, ...]


def load_config(path: Path) -> RunConfig:
    """Read a configuration, resolved or not; relative paths in it are relative to its own directory.

    >>> from pathlib import Path
    >>> from protocol.config_file import load_config
    >>> path = Path("short.toml")
    >>> _ = path.write_text("[learner.sac]\\nbatch_size = 64")
    >>> config = load_config(path)
    >>> config.learner.sac.batch_size, config.learner.sac.gamma
    (64, 0.98)

    Raises:
        InvalidConfig: the file is missing, is not UTF-8 or not TOML, names an unknown field or has a value out of
            range; or it is a resolved configuration that lacks a setting.
    """
    table = _read_table(path)
    _require_present_names(table, path)
    mark = _mark_of(table, path)
    if mark is not None:
        _require_all(table, mark, path)
    return with_absolute_paths(_config_of(table, path), path.parent)


def load_resolved_config(path: Path) -> RunConfig:
    """Read a resolved configuration, which must have every setting.

    One of a version that wrote no mark may lack settings that change no result; others are never guessed.

    Raises:
        InvalidConfig: as in `load_config`; or it lacks a setting, or has a relative path and no mark.
    """
    table = _read_table(path)
    _require_present_names(table, path)
    mark = _mark_of(table, path)
    _require_all(table, mark, path)
    config = _config_of(table, path)
    if mark is None and (relative := relative_paths(config)):
        names = ", ".join(f"{setting.name} = {str(setting.path)!r}" for setting in relative)
        raise InvalidConfig(
            f"{path} says {names}, and an older version of Vantage took that as relative to its working "
            "directory; write the absolute path into it"
        )
    return with_absolute_paths(config, path.parent)


def load_run_config(run: Path) -> RunConfig:
    """Read the configuration of a run directory, which is resolved if the orchestrator made the directory.

    Raises:
        InvalidConfig: as in `load_resolved_config` or `load_config`.
    """
    made_by_orchestrator = (run / "plan.json").exists()
    return (load_resolved_config if made_by_orchestrator else load_config)(run / "config.toml")


def recorded_config(text: bytes, path: Path) -> RunConfig:
    """The configuration that an experiment's table records.

    Args:
        text: the TOML in the table.
        path: the table's file, for messages.

    Raises:
        InvalidConfig: the text is not a configuration.
    """
    table = _parsed(text, path)
    _mark_of(table, path)
    return _config_of(table, path)


def with_checksums(config: RunConfig) -> RunConfig:
    """A configuration that records the checksums of its files.

    Raises:
        InvalidConfig: a file that it names does not exist.
        OtherArtifact: it already records another checksum of a file.
    """
    require_same_files(config, config.artifacts)
    return replace(config, artifacts=config.artifacts | checksums_of(config))


def for_a_run(config: RunConfig, *, joined: bool = False) -> RunConfig:
    """A configuration for a run: with its files' checksums, and with the profile's choices in place of `auto`.

    So a run does not change if a later version of Vantage chooses otherwise. Errors as in `with_checksums`.

    Args:
        joined: whether the workers are a host's. They read files of their own, so files on this machine don't count.
    """
    known = config if joined else with_checksums(config)
    return replace(known, perception=settled(known.perception, known.profile))


def require_recorded_files(config: RunConfig, section: str = "") -> None:
    """Make sure that the files of a configuration, or of one of its sections, have the checksums that it records.

    Raises:
        OtherArtifact: a file was changed or is missing.
    """
    require_same_files(config, config.artifacts, section)


def with_content_alone(config: RunConfig) -> RunConfig:
    """A configuration with each recorded file's checksum in place of its path, so that its place does not count."""
    return replace(with_content(config, config.artifacts), artifacts={})


def same_for(config: RunConfig) -> RunConfig:
    """A form that is equal for configurations of the same meaning: with the profile's choices, and files' checksums."""
    known = with_content_alone(config)
    return replace(known, perception=settled(known.perception, known.profile))


def resolved(config: RunConfig) -> dict[str, Any]:
    """A configuration as a table of plain values with every setting and the mark of a resolved one."""
    table = msgspec.to_builtins(config)
    mark = _Resolved(format=_FORMAT, left_out=tuple(_none_in(table)))
    scalars = {name: value for name, value in table.items() if not isinstance(value, dict)}
    # The mark comes before all other tables, so that a truncated file still has it.
    return _without_none(scalars | {_RESOLVED: msgspec.to_builtins(mark)} | table)


def plain(config: RunConfig) -> dict[str, Any]:
    """A configuration as a table of plain values with every setting that is not None, without the mark."""
    return {name: value for name, value in _without_none(msgspec.to_builtins(config)).items() if value != {}}


def _read_table(path: Path) -> dict[str, Any]:
    try:
        text = path.read_bytes()
    except OSError as error:
        raise InvalidConfig(f"can't read the configuration {path}: {error.strerror}") from error
    return _parsed(text, path)


def _parsed(text: bytes, path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(utf8_text(text))
    except NotUtf8 as error:
        raise InvalidConfig(f"{path} {error}") from error
    except RecursionError as error:
        raise InvalidConfig(f"{path} is not a configuration: it nests its lists or tables too deeply") from error
    except (ValueError, *UNDECODABLE) as error:
        raise InvalidConfig(f"{path}: {error}") from error


def _require_present_names(table: dict[str, Any], path: Path) -> None:
    renamed = [f"{old} is {new}" for old, new in renamed_in(table)]
    if renamed:
        raise InvalidConfig(f"{path} has settings that were renamed: {', '.join(renamed)}")


def _mark_of(table: dict[str, Any], path: Path) -> _Resolved | None:
    """Remove the mark from a table, and return it; None if there is none."""
    if _RESOLVED not in table:
        return None
    try:
        mark = msgspec.convert(table.pop(_RESOLVED), _Resolved)
    except msgspec.ValidationError as error:
        raise InvalidConfig(f"{path} is damaged: {_RESOLVED}: {error}") from error
    if mark.format > _FORMAT:
        raise InvalidConfig(f"{path} was written by a later version of Vantage; use that")
    return mark


def _require_all(table: dict[str, Any], mark: _Resolved | None, path: Path) -> None:
    format_, left_out = (mark.format, mark.left_out) if mark else (0, _none_in(msgspec.to_builtins(RunConfig())))
    may_lack = {name for last, names in _CAME_AFTER.items() if last >= format_ for name in names} | set(left_out)
    missing = [name for name in lacking(table, RunConfig) if name not in may_lack]
    if not missing:
        return
    words = ", ".join(missing[:_MOST_NAMED]) + (" …" if len(missing) > _MOST_NAMED else "")
    whence = "" if mark else ", or an older version of Vantage wrote it"
    raise InvalidConfig(f"{path} is damaged{whence}: it lacks {words}; take it from a copy, or write them into it")


def _config_of(table: dict[str, Any], path: Path) -> RunConfig:
    try:
        return msgspec.convert(table, RunConfig)
    except (*UNDECODABLE, InvalidConfig) as error:
        raise InvalidConfig(f"{path}: {error}") from error


def _none_in(table: dict[str, Any], prefix: str = "") -> list[str]:
    """The names of the settings that are None."""
    names: list[str] = []
    for name, value in table.items():
        if isinstance(value, dict):
            names += _none_in(cast(dict[str, Any], value), f"{prefix}{name}.")
        elif value is None:
            names.append(f"{prefix}{name}")
    return names


def _without_none(table: dict[str, Any]) -> dict[str, Any]:
    return {
        name: _without_none(cast(dict[str, Any], value)) if isinstance(value, dict) else value
        for name, value in table.items()
        if value is not None
    }
