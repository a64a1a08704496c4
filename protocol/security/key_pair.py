"""A process's key pair: a file that only its owner can read."""

import os
from pathlib import Path
from typing import Annotated

import msgspec
import zmq
from msgspec import Meta, Struct

from protocol.artifact import sync_directory
from protocol.errors import InvalidInput, NotPermitted
from protocol.messages import Role
from protocol.security.secret_file import read_secret
from protocol.text import UNDECODABLE

KeyName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
PublicKey = Annotated[str, Meta(min_length=40, max_length=40)]
"""Z85 text, as ZeroMQ writes keys: 40 characters for 32 bytes."""


class KeyPair(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A key pair of a role. `secret` never leaves its machine, and is never printed."""

    name: KeyName
    role: Role
    public: PublicKey
    secret: PublicKey

    def __repr__(self) -> str:
        return f"KeyPair(name={self.name!r}, role={self.role.value!r}, public={self.public!r})"


def new_key_pair(name: str, role: Role) -> KeyPair:
    """Generate a key pair with the system's randomness.

    Raises:
        InvalidInput: `name` is not a valid name for a key.
    """
    public, secret = zmq.curve_keypair()
    drawn = {"name": name, "role": role, "public": public.decode(), "secret": secret.decode()}
    try:
        return msgspec.convert(drawn, KeyPair)
    except msgspec.ValidationError as error:
        raise InvalidInput(
            f"{name!r} is not a name for a key: use letters, digits, '.', '_' and '-', at most 64"
        ) from error


def write_key(key: KeyPair, path: Path) -> None:
    """Write a key to a file that only its owner can read.

    Raises:
        InvalidInput: the file exists already; a key is never overwritten.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError as error:
        raise InvalidInput(f"{path} is there already; revoke that key first, or choose another name") from error
    with os.fdopen(descriptor, "wb") as file:
        file.write(msgspec.json.format(msgspec.json.encode(key), indent=2) + b"\n")
        file.flush()
        os.fsync(file.fileno())
    sync_directory(path.parent)


def read_key(path: Path) -> KeyPair:
    """Read a key's file.

    Raises:
        NotPermitted: the file is missing or not a key, its two keys do not match, or other users can read it.
    """
    try:
        key = msgspec.json.decode(read_secret(path, "key"), type=KeyPair)
    except OSError as error:
        raise NotPermitted(f"can't read the key {path}: {error.strerror}; 'orchestrator keys new' makes one") from error
    except UNDECODABLE as error:
        raise NotPermitted(f"{path} is not a key: {error}; 'orchestrator keys new' makes one") from error
    if not _fits_together(key):
        raise NotPermitted(f"{path} is damaged: its public key is not that of its secret one")
    return key


def _fits_together(key: KeyPair) -> bool:
    try:
        return zmq.curve_public(key.secret.encode("ascii")).decode() == key.public
    except (ValueError, UnicodeEncodeError, zmq.ZMQError):
        return False
