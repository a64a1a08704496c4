"""The options of every process that speaks between machines, and what they come to."""

import argparse
from collections.abc import Mapping
from pathlib import Path

from protocol.errors import InvalidInput
from protocol.security.credentials import load_credentials
from protocol.security.policy import Security

KEY_VARIABLE = "VANTAGE_KEY"
"""Where the option `--key` is not given, the environment may name the file."""


def add_security_options(parser: argparse.ArgumentParser) -> None:
    """`--key`, `--allowed` and `--insecure`."""
    parser.add_argument(
        "--key",
        type=Path,
        metavar="FILE",
        help=f"this process' key, made by 'orchestrator keys new' (default: what {KEY_VARIABLE} names)",
    )
    parser.add_argument(
        "--allowed", type=Path, metavar="FILE", help="the list of allowed keys (default: allowed.json beside the key)"
    )
    parser.add_argument(
        "--insecure", action="store_true", help="speak between machines without keys: whoever reaches us may use us"
    )


def security_of(options: argparse.Namespace, environment: Mapping[str, str]) -> Security:
    """What the options come to.

    Raises:
        InvalidInput: keys and `--insecure` at once.
        NotPermitted: a file is missing, damaged or open to others, or the key is not allowed.
    """
    return security_from(options.key, options.allowed, insecure=options.insecure, environment=environment)


def security_from(
    key: Path | None, allowed: Path | None, *, insecure: bool, environment: Mapping[str, str]
) -> Security:
    """As `security_of`, from the options' values."""
    if key is None and not insecure and environment.get(KEY_VARIABLE):
        key = Path(environment[KEY_VARIABLE])
    if key is None:
        if allowed is not None:
            raise InvalidInput("--allowed says whose keys count; it needs --key, this process' own")
        return Security(insecure=insecure)
    if insecure:
        raise InvalidInput("--insecure means without keys; leave out --key, or --insecure")
    return Security(load_credentials(key, allowed))
