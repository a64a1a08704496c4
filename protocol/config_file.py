"""A configuration's file, as somebody wrote it, or resolved, as the orchestrator writes it down for all of a run.

In a resolved one every setting is there, every path is absolute, and the checksums of the files are recorded: what is
missing was lost, and what is another one now is not gone on with.
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
"""The table that marks a configuration as resolved."""

_FORMAT = 1

_CAME_AFTER: dict[int, frozenset[str]] = {0: frozenset({"render.prefetch", "artifacts"})}
"""Settings that came after a format, and change nothing of what came out of configurations without them.

Others that came later are never guessed. Before the first format, resolved configurations had no mark.
"""

_MOST_NAMED = 5
"""Settings that a message names."""


class _Resolved(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The mark.

    Attributes:
        format: of the resolved configuration.
        left_out: the settings that are none, since TOML has no word for it; all others are written down.
    """

    format: Annotated[int, Meta(ge=1)]
    left_out: tuple[str, ...]


def load_config(path: Path) -> RunConfig:
    """Read a configuration, whoever wrote it; its relative paths are relative to its own directory.

    Raises:
        InvalidConfig: the file is missing, is not UTF-8, is no TOML, names an unknown field or has a value out of
            range; or it was resolved once, and lacks a setting now.
    """
    table = _read_table(path)
    _require_present_names(table, path)
    mark = _mark_of(table, path)
    if mark is not None:
        _require_all(table, mark, path)
    return with_absolute_paths(_config_of(table, path), path.parent)


def load_resolved_config(path: Path) -> RunConfig:
    """Read a configuration that was resolved, in which everything must be there.

    One of a version that did not mark them may lack settings that change no result; others are never guessed.

    Raises:
        InvalidConfig: as `load_config`; or it lacks a setting, or has a relative path and is of no known directory.
    """
    table = _read_table(path)
    _require_present_names(table, path)
    mark = _mark_of(table, path)
    _require_all(table, mark, path)
    config = _config_of(table, path)
    if mark is None and (relative := relative_paths(config)):
        names = ", ".join(f"{setting.name} = {str(setting.path)!r}" for setting in relative)
        raise InvalidConfig(
            f"{path} says {names}, and an older version of Vantage took that from wherever it was called; "
            "write the absolute path into it"
        )
    return with_absolute_paths(config, path.parent)


def load_run_config(run: Path) -> RunConfig:
    """The configuration of a run directory: a resolved one where the orchestrator made it; errors as there."""
    made_by_orchestrator = (run / "plan.json").exists()
    return (load_resolved_config if made_by_orchestrator else load_config)(run / "config.toml")


def recorded_config(text: bytes, path: Path) -> RunConfig:
    """The configuration that a table of an experiment, the file at `path`, says that it was made with.

    Raises:
        InvalidConfig: it says something else.
    """
    table = _parsed(text, path)
    _mark_of(table, path)
    return _config_of(table, path)


def with_checksums(config: RunConfig) -> RunConfig:
    """A configuration that records which files it names.

    Raises:
        InvalidConfig: a file that it names is not there.
        OtherArtifact: it has a checksum already, which is another one.
    """
    require_same_files(config, config.artifacts)
    return replace(config, artifacts=config.artifacts | checksums_of(config))


def for_a_run(config: RunConfig, *, joined: bool = False) -> RunConfig:
    """A configuration as a run is told it: with its files recorded, and with the profile's choices made.

    A later version of Vantage may choose otherwise; that is no reason for a run to change. Errors as `with_checksums`.

    Args:
        joined: the workers are a host's and read files of their own, so that those that are here say nothing.
    """
    known = config if joined else with_checksums(config)
    return replace(known, perception=settled(known.perception, known.profile))


def require_recorded_files(config: RunConfig, section: str = "") -> None:
    """Make sure that the files that a configuration names, or those of one of its sections, are those of its record.

    Raises:
        OtherArtifact: one of them is another one, or is gone.
    """
    require_same_files(config, config.artifacts, section)


def with_content_alone(config: RunConfig) -> RunConfig:
    """A configuration in which files count by what is in them, wherever they are."""
    return replace(with_content(config, config.artifacts), artifacts={})


def same_for(config: RunConfig) -> RunConfig:
    """What two configurations have in common that say the same: the profile's choices, and files by their content."""
    known = with_content_alone(config)
    return replace(known, perception=settled(known.perception, known.profile))


def resolved(config: RunConfig) -> dict[str, Any]:
    """A configuration as a table of plain values with every setting written out, and a mark that says so."""
    table = msgspec.to_builtins(config)
    mark = _Resolved(format=_FORMAT, left_out=tuple(_none_in(table)))
    scalars = {name: value for name, value in table.items() if not isinstance(value, dict)}
    # The mark stands before all other tables: what was cut off either has it still, or has next to nothing.
    return _without_none(scalars | {_RESOLVED: msgspec.to_builtins(mark)} | table)


def plain(config: RunConfig) -> dict[str, Any]:
    """A configuration as a table of plain values with every setting written out that is not none, and no mark."""
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
        raise InvalidConfig(f"{path} is no configuration: it nests its lists or tables too deeply") from error
    except (ValueError, *UNDECODABLE) as error:
        raise InvalidConfig(f"{path}: {error}") from error


def _require_present_names(table: dict[str, Any], path: Path) -> None:
    renamed = [f"{old} is {new}" for old, new in renamed_in(table)]
    if renamed:
        raise InvalidConfig(f"{path} has settings that are called otherwise now: {', '.join(renamed)}")


def _mark_of(table: dict[str, Any], path: Path) -> _Resolved | None:
    """Take the mark out of a table; None where there is none."""
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
