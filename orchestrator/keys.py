"""The keys of a deployment: made, listed and revoked in one directory, and copied from there to each machine.

A machine needs the file of its own key and the list of all allowed keys. The list holds no secret, and it alone decides
which keys are allowed: copied to a machine, it is in force there at once.
"""

from pathlib import Path

from rich.table import Table

from protocol.errors import InvalidInput
from protocol.messages import Role
from protocol.security.allow_list import AllowList, read_allow_list, write_allow_list
from protocol.security.credentials import ALLOWED
from protocol.security.key_pair import new_key_pair, write_key


def new_key(directory: Path, name: str, role: Role) -> Path:
    """Make a key and allow it; returns its file.

    Raises:
        InvalidInput: there is a key of this name, or it is no name.
        NotPermitted: the list that is there can't be read.
    """
    key = new_key_pair(name, role)
    allowed = _list_in(directory).with_key(key)
    path = directory / f"{name}.key"
    write_key(key, path)
    write_allow_list(allowed, directory / ALLOWED)
    return path


def revoke_key(directory: Path, name: str) -> None:
    """Revoke a key. Its file stays, since it is on other machines as well.

    Raises:
        InvalidInput: there is no such key, or it is revoked already.
        NotPermitted: the list can't be read.
    """
    write_allow_list(read_allow_list(directory / ALLOWED).without(name), directory / ALLOWED)


def listed_keys(directory: Path) -> AllowList:
    """All keys that were ever made here, revoked ones too.

    Raises:
        InvalidInput: none was made there.
        NotPermitted: the list can't be read.
    """
    if not (directory / ALLOWED).exists():
        raise InvalidInput(f"there are no keys in {directory}; 'orchestrator keys new' makes one")
    return read_allow_list(directory / ALLOWED)


def keys_table(allowed: AllowList) -> Table:
    """The list as a table for display."""
    table = Table("name", "role", "public key", "")
    for key in allowed.keys:
        table.add_row(key.name, key.role.value, key.public, "revoked" if key.revoked else "allowed")
    return table


def _list_in(directory: Path) -> AllowList:
    return read_allow_list(directory / ALLOWED) if (directory / ALLOWED).exists() else AllowList()
