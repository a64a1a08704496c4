"""The files that a configuration names: their paths, and whether they have changed.

A setting that takes a path only needs the mark `NamedFile`. Its path is then relative to the configuration's own file,
its checksum is recorded in a run, and the run can't be resumed with another file.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar, get_args, get_origin

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from protocol.artifact import checksum_if_there
from protocol.errors import InvalidConfig, OtherArtifact
from protocol.text import readable

SectionT = TypeVar("SectionT", bound=Struct)

_CHECKSUM = "sha256:"


class NamedFile(Struct, frozen=True):
    """Marks a setting that takes a path: `Annotated[str, NamedFile("the lifter", words="auto")]`.

    Attributes:
        noun: what the file is, for messages.
        words: a regular expression of the values that are not paths.
        otherwise: returns the default file of a setting without a value.
    """

    noun: str
    words: str | None = None
    otherwise: Callable[[], Path] | None = None

    def is_path(self, value: str) -> bool:
        """Whether a value is a path."""
        return self.words is None or re.fullmatch(self.words, value) is None


class Setting(NamedTuple):
    """A setting that takes a path, with its value."""

    name: str
    mark: NamedFile
    value: str | None

    @property
    def path(self) -> Path | None:
        """The file that the setting names, or its default file; None if it names none."""
        if not self.value:
            return None if self.mark.otherwise is None else self.mark.otherwise()
        return Path(self.value) if self.mark.is_path(self.value) else None


def path_settings(section: Struct, prefix: str = "") -> Iterator[Setting]:
    """Every setting of a configuration that takes a path."""
    for field in msgspec.structs.fields(section):
        value, name = getattr(section, field.name), f"{prefix}{field.name}"
        if isinstance(value, Struct):
            yield from path_settings(value, f"{name}.")
        elif (mark := _mark_of(field.type)) is not None:
            yield Setting(name, mark, value)


def with_absolute_paths(config: SectionT, directory: Path) -> SectionT:
    """A configuration with its relative paths made absolute, as paths in a directory.

    Raises:
        InvalidConfig: the directory's name is not UTF-8, so a configuration can't hold it.
    """
    base = directory.resolve()

    def absolute(setting: Setting) -> str | None:
        path = Path(setting.value or "")
        if not setting.value or path.is_absolute():
            return setting.value
        return _writable(setting.name, str(base / path))

    return _with_paths(config, absolute)


def relative_paths(config: Struct) -> tuple[Setting, ...]:
    """The settings whose value is a relative path."""
    named = ((setting, setting.path) for setting in path_settings(config))
    return tuple(setting for setting, path in named if path is not None and not path.is_absolute())


def with_content(config: SectionT, checksums: Mapping[str, str]) -> SectionT:
    """A configuration with each file's checksum, if it is known, in place of its path."""
    return _with_paths(
        config,
        lambda setting: f"{_CHECKSUM}{checksums[setting.name]}" if setting.name in checksums else setting.value,
    )


def is_checksum(value: str) -> bool:
    """Whether a value is a checksum in place of a path."""
    return value.startswith(_CHECKSUM)


def checksums_of(config: Struct) -> dict[str, str]:
    """The sha256 of every file of a configuration, by the setting's name; default files count if they exist.

    Raises:
        InvalidConfig: a file that it names does not exist.
    """
    found: dict[str, str] = {}
    for setting in path_settings(config):
        checksum = None if setting.path is None else checksum_if_there(setting.path)
        if checksum is not None:
            found[setting.name] = checksum
        elif setting.value and setting.path is not None:
            raise InvalidConfig(f"{setting.name}: there is no file {setting.path}")
    return found


def require_same_files(config: Struct, checksums: Mapping[str, str], section: str = "") -> None:
    """Make sure that a configuration's files have the recorded checksums.

    Args:
        checksums: by the setting's name.
        section: the prefix of the settings to check; empty for all.

    Raises:
        OtherArtifact: a file was changed or is missing.
        InvalidConfig: a recorded name is not that of a setting with a file.
    """
    named = {setting.name: setting for setting in path_settings(config)}
    for name, checksum in checksums.items():
        if not name.startswith(section):
            continue
        if name not in named or (path := named[name].path) is None:
            raise InvalidConfig(f"artifacts: a checksum of {name} is recorded, and that names no file")
        found, noun = checksum_if_there(path), named[name].mark.noun
        if found is None:
            raise OtherArtifact(f"{name}: {noun} {path} is missing; put it back, or write into {name} where it is now")
        if found != checksum:
            raise OtherArtifact(
                f"{name}: {noun} is another one: {path} has the checksum {found[:12]}…, and what was recorded is "
                f"{checksum[:12]}…; put that file back, or begin anew with this one"
            )


def _writable(name: str, path: str) -> str:
    shown = readable(path)
    if shown != path:
        raise InvalidConfig(f"{name}: the name of {shown} is not UTF-8, as configurations are; rename its folder")
    return path


def _with_paths(section: SectionT, change: Callable[[Setting], str | None], prefix: str = "") -> SectionT:
    values: dict[str, Any] = {}
    for field in msgspec.structs.fields(section):
        value, name = getattr(section, field.name), f"{prefix}{field.name}"
        if isinstance(value, Struct):
            values[field.name] = _with_paths(value, change, f"{name}.")
        elif value is not None and (mark := _mark_of(field.type)) is not None and mark.is_path(value):
            values[field.name] = change(Setting(name, mark, value))
    return replace(section, **values)


def _mark_of(annotation: Any) -> NamedFile | None:
    """The mark in a field's type, also in an optional one."""
    if get_origin(annotation) is Annotated:
        return next((mark for mark in get_args(annotation)[1:] if isinstance(mark, NamedFile)), None)
    marks = (_mark_of(part) for part in get_args(annotation))
    return next((mark for mark in marks if mark is not None), None)
