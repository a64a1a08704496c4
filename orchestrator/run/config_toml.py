"""A configuration as TOML."""

import tomli_w

from protocol.config import RunConfig
from protocol.config_file import plain, resolved


def resolved_toml(config: RunConfig) -> bytes:
    """The resolved configuration as TOML: with every setting, and marked as resolved."""
    return tomli_w.dumps(resolved(config)).encode()


def plain_toml(config: RunConfig) -> bytes:
    """The configuration as TOML for a table's metadata, without the mark."""
    return tomli_w.dumps(plain(config)).encode()
