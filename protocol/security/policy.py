"""Which addresses need a key: all that other machines can reach."""

import ipaddress
import re
from typing import NamedTuple

from protocol.errors import AddressUnavailable, NotPermitted
from protocol.messages import Role
from protocol.security.credentials import Credentials
from protocol.security.key_pair import KeyPair
from protocol.transport.address import check_address, ipc_path

_HOST = re.compile(r"tcp://(?:\[(?P<six>[^\]]+)\]|(?P<host>[^:]+)):")


class Curve(NamedTuple):
    """The keys of a client's socket: its own, and the public key that the worker has to prove."""

    own: KeyPair
    server: str


class Security(NamedTuple):
    """How a process talks to other machines: with credentials, or with `insecure` without any."""

    credentials: Credentials | None = None
    insecure: bool = False

    def require_role(self, role: Role) -> None:
        """Raise `NotPermitted` if there is a key of another role."""
        if self.credentials is not None and self.credentials.own.role is not role:
            own = self.credentials.own
            raise NotPermitted(
                f"the key {own.name!r} is of the role {own.role}, and this process needs one of the role {role}; "
                f"'orchestrator keys new NAME --role {role}' makes one"
            )

    def credentials_for(self, address: str) -> Credentials | None:
        """The credentials of a socket at an address: those of the process on `tcp://`, None on `ipc://`.

        Raises:
            AddressUnavailable: it is not an address.
            NotPermitted: other machines can reach it, and there is neither a key nor `insecure`.
        """
        if ipc_path(check_address(address)) is not None:
            return None
        if self.credentials is None and not self.insecure and not is_local(address):
            raise NotPermitted(
                f"{address} can be reached from other machines, and there is no key: make one by "
                "'orchestrator keys new' and give it by --key; or say --insecure, and all who reach it may use it"
            )
        return self.credentials

    def curve_to(self, address: str, role: Role | None, announced: str = "") -> Curve | None:
        """The keys of a client's socket to a worker; None without keys.

        Args:
            announced: the worker's key in the orchestrator's table; empty if it has none there.

        Raises:
            AddressUnavailable: it is not an address that can be called.
            NotPermitted: as in `credentials_for`; or the worker's key is not valid, or is not known.
        """
        if address.startswith("tcp://*"):
            raise AddressUnavailable(f"{address} is where a worker may bind; to call it, name its host")
        credentials = self.credentials_for(address)
        return None if credentials is None else Curve(credentials.own, credentials.server_key(role, announced))


def is_local(address: str) -> bool:
    """Whether only this machine can reach an address."""
    if ipc_path(address) is not None:
        return True
    match = _HOST.match(address)
    if match is None:
        return False
    host = match["six"] or match["host"]
    try:
        return ipaddress.ip_address(host.partition("%")[0]).is_loopback
    except ValueError:
        return host == "localhost"


LOCAL_ONLY = Security()
"""Without keys: allowed within a machine, refused beyond it."""
