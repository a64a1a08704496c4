"""The list of allowed public keys and their roles: one file, the same on every machine, without secrets."""

import logging
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta, Struct
from msgspec.structs import replace

from protocol.artifact import whole_file
from protocol.errors import InvalidInput, NotPermitted
from protocol.messages import Role
from protocol.security.key_pair import KeyName, KeyPair, PublicKey
from protocol.system.process_lock import ProcessLock
from protocol.text import UNDECODABLE

_log = logging.getLogger(__name__)


class AllowedKey(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One key. A revoked key stays in the list, so that logs can name a process that tries it."""

    name: KeyName
    role: Role
    public: PublicKey
    revoked: bool = False


class AllowList(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All keys that were ever allowed, in the order in which they were made."""

    format: Annotated[int, Meta(ge=1, le=1)] = 1
    keys: tuple[AllowedKey, ...] = ()

    def find(self, public: str) -> AllowedKey | None:
        """The entry of a public key, revoked or not."""
        return next((key for key in self.keys if key.public == public), None)

    def role_of(self, public: str) -> Role | None:
        """The role of a key's holder; None for a key that is unknown or revoked."""
        found = self.find(public)
        return found.role if found is not None and not found.revoked else None

    def of_role(self, role: Role) -> tuple[AllowedKey, ...]:
        """The valid keys of a role."""
        return tuple(key for key in self.keys if key.role is role and not key.revoked)

    def with_key(self, key: KeyPair) -> "AllowList":
        """The list with one more key.

        Raises:
            InvalidInput: the list has a key of this name.
        """
        if any(known.name == key.name for known in self.keys):
            raise InvalidInput(f"there is a key {key.name!r} already; choose another name")
        allowed = AllowedKey(name=key.name, role=key.role, public=key.public)
        return replace(self, keys=(*self.keys, allowed))

    def without(self, name: str) -> "AllowList":
        """The list with the key of this name revoked.

        Raises:
            InvalidInput: the list has no such key, or it is revoked already.
        """
        found = next((key for key in self.keys if key.name == name), None)
        if found is None:
            raise InvalidInput(f"there is no key {name!r}; 'orchestrator keys list' names them")
        if found.revoked:
            raise InvalidInput(f"the key {name!r} is revoked already")
        return replace(self, keys=tuple(replace(key, revoked=True) if key is found else key for key in self.keys))


def read_allow_list(path: Path) -> AllowList:
    """Read a list of keys.

    Raises:
        NotPermitted: the file is missing, or is not a list of keys.
    """
    try:
        return msgspec.json.decode(path.read_bytes(), type=AllowList)
    except OSError as error:
        raise NotPermitted(f"can't read the list of allowed keys {path}: {error.strerror}") from error
    except UNDECODABLE as error:
        raise NotPermitted(f"{path} is not a list of allowed keys: {error}") from error


def write_allow_list(allowed: AllowList, path: Path) -> None:
    """Write a list atomically: a reader sees the old one or the new one."""
    with whole_file(path) as aside:
        aside.write_bytes(msgspec.json.format(msgspec.json.encode(allowed), indent=2) + b"\n")


class AllowListFile:
    """A list that is read again when its file has changed, so that a revoked key is refused at once without a restart.

    May be used by any number of threads. If the file can't be read any more, the last list stays valid.
    """

    def __init__(self, path: Path) -> None:
        """Read the file; errors as in `read_allow_list`."""
        self._path = path
        self._lock = ProcessLock()
        self._stamp = _stamp(path)
        self._current = read_allow_list(path)

    def current(self) -> AllowList:
        """The list as the file has it now."""
        with self._lock:
            stamp = _stamp(self._path)
            if stamp != self._stamp:
                self._stamp = stamp
                self._read_again()
            return self._current

    def _read_again(self) -> None:
        try:
            self._current = read_allow_list(self._path)
            _log.info("read the list of allowed keys again: %d keys", len(self._current.keys))
        except NotPermitted as error:
            _log.error("the keys that were allowed before stay valid: %s", error)


def _stamp(path: Path) -> tuple[int, int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
