"""The command line's options for keys, and the `Security` that they mean."""

import argparse
from collections.abc import Mapping
from pathlib import Path

from protocol.errors import InvalidInput
from protocol.security.credentials import load_credentials
from protocol.security.policy import Security

KEY_VARIABLE = "VANTAGE_KEY"
"""The environment variable that names the key's file where `--key` is not given."""


def add_security_options(parser: argparse.ArgumentParser) -> None:
    """Add `--key`, `--allowed` and `--insecure`."""
    parser.add_argument(
        "--key",
        type=Path,
        metavar="FILE",
        help=f"this process's key, made by 'orchestrator keys new' (default: what {KEY_VARIABLE} names)",
    )
    parser.add_argument(
        "--allowed", type=Path, metavar="FILE", help="the list of allowed keys (default: allowed.json beside the key)"
    )
    parser.add_argument(
        "--insecure",
        action="store_true",
        help="talk to other machines without keys: every machine that reaches this process may use it",
    )


def security_of(options: argparse.Namespace, environment: Mapping[str, str]) -> Security:
    """The security that the options mean.

    Raises:
        InvalidInput: keys and `--insecure` at once.
        NotPermitted: a file is missing or damaged, other users can read the key, or the key is not allowed.
    """
    return security_from(options.key, options.allowed, insecure=options.insecure, environment=environment)


def security_from(
    key: Path | None, allowed: Path | None, *, insecure: bool, environment: Mapping[str, str]
) -> Security:
    """The same as `security_of`, from the options' values."""
    if key is None and not insecure and environment.get(KEY_VARIABLE):
        key = Path(environment[KEY_VARIABLE])
    if key is None:
        if allowed is not None:
            raise InvalidInput("--allowed names the list of allowed keys; it needs --key, this process's own key")
        return Security(insecure=insecure)
    if insecure:
        raise InvalidInput("--insecure means without keys; leave out --key, or --insecure")
    return Security(load_credentials(key, allowed))
