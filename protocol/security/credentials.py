"""The credentials of a process between machines: its own key, and the list of allowed keys."""

from pathlib import Path

from protocol.errors import NotPermitted
from protocol.messages import Role
from protocol.security.allow_list import AllowedKey, AllowListFile
from protocol.security.key_pair import KeyPair, read_key

ALLOWED = "allowed.json"
"""The file name of the list of allowed keys, in the directory of the key."""


class Credentials:
    """A process's own key and the list of allowed keys. May be used by any number of threads."""

    def __init__(self, own: KeyPair, allowed: AllowListFile) -> None:
        self.own = own
        self._allowed = allowed

    def find(self, public: str) -> AllowedKey | None:
        """The entry of a public key, revoked or not."""
        return self._allowed.current().find(public)

    def role_of(self, public: str) -> Role | None:
        """The role of a key's holder now; None for a key that is unknown or revoked."""
        return self._allowed.current().role_of(public)

    def server_key(self, role: Role | None, announced: str = "") -> str:
        """The public key that a worker has to prove.

        Args:
            role: the role that the worker must have; None for any.
            announced: the worker's key in the orchestrator's table; empty if it has none there.

        Raises:
            NotPermitted: the announced key is not valid for the role; or there is none, and the list has no key or
                several keys for the role.
        """
        if announced:
            self._require_role(announced, role)
            return announced
        roles = tuple(Role) if role is None else (role,)
        candidates = [key for one in roles for key in self._allowed.current().of_role(one)]
        what = "any" if role is None else role.value
        if not candidates:
            raise NotPermitted(f"no key is allowed for the role {what}; 'orchestrator keys new' makes one")
        if len(candidates) > 1:
            names = ", ".join(key.name for key in candidates)
            raise NotPermitted(
                f"a {what} worker may have one of several keys ({names}); let the orchestrator name its address and "
                "key (--orchestrator), or allow a single key for the role"
            )
        return candidates[0].public

    def _require_role(self, public: str, role: Role | None) -> None:
        found = self.role_of(public)
        if found is None:
            raise NotPermitted(f"the key {public[:8]}… of a worker is not allowed, or was revoked")
        if role is not None and found is not role:
            raise NotPermitted(f"the key {public[:8]}… is that of a {found.value}, not of a {role.value}")


def load_credentials(key: Path, allowed: Path | None = None) -> Credentials:
    """Read a process's key and the list of allowed keys, by default `allowed.json` beside the key.

    Raises:
        NotPermitted: a file is missing or damaged, other users can read the key, or the list has no such key.
    """
    own = read_key(key)
    listed = AllowListFile(key.parent / ALLOWED if allowed is None else allowed)
    if listed.current().role_of(own.public) is not own.role:
        raise NotPermitted(
            f"the key {key} ({own.name}, {own.role}) is not in the list of allowed keys, or was revoked; "
            "copy the newest list to this machine, or make another key by 'orchestrator keys new'"
        )
    return Credentials(own, listed)
