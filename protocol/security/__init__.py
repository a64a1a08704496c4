"""Who may speak with whom between machines: key pairs, the list of allowed keys, and what each role may ask for.

Every process has a key pair of its own role and the list of everybody's public keys. CURVE encrypts what is said and
proves who says it; the list says which keys count, and as what (docs/security.md).
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
