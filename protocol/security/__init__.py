"""Security between machines: key pairs, the list of allowed keys, and the permissions of each role.

Every process has a key pair of its role, and the list of allowed public keys. CURVE encrypts messages and proves the
sender's key; the list says which keys are valid, and for which role (docs/security.md).
"""

from protocol.security.allow_list import AllowedKey, AllowList, AllowListFile
from protocol.security.credentials import Credentials, load_credentials
from protocol.security.key_pair import KeyPair, new_key_pair, read_key, write_key
from protocol.security.policy import LOCAL_ONLY, Curve, Security, is_local

__all__ = [
    "LOCAL_ONLY",
    "AllowList",
    "AllowListFile",
    "AllowedKey",
    "Credentials",
    "Curve",
    "KeyPair",
    "Security",
    "is_local",
    "load_credentials",
    "new_key_pair",
    "read_key",
    "write_key",
]
