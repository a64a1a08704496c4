"""The token with which a monitor may end the process."""

import hmac
from collections.abc import Mapping
from pathlib import Path

from protocol.errors import NotPermitted
from protocol.security.secret_file import read_secret

TOKEN_VARIABLE = "VANTAGE_HTTP_TOKEN"
"""The environment variable that names the token's file where `--http-token` is not given."""

_SHORTEST = 16
_HINT = "'openssl rand -hex 32' makes one"


def token_from(file: Path | None, environment: Mapping[str, str]) -> str:
    """The token that control calls need; empty if there are no control calls.

    Raises:
        NotPermitted: the file can't be read, other users can read it, or its token is too short or has spaces.
    """
    if file is None and environment.get(TOKEN_VARIABLE):
        file = Path(environment[TOKEN_VARIABLE])
    if file is None:
        return ""
    try:
        token = read_secret(file, "token").decode("ascii").strip()
    except OSError as error:
        raise NotPermitted(f"can't read the token {file}: {error.strerror}; {_HINT}") from error
    except UnicodeDecodeError as error:
        raise NotPermitted(f"{file} is not a token: it has other characters than ASCII") from error
    if len(token) < _SHORTEST or not token.isprintable() or " " in token:
        raise NotPermitted(f"{file} holds no token: {_SHORTEST} characters or more without a space are one; {_HINT}")
    return token


def is_same(shown: str, token: str) -> bool:
    """Whether two tokens are equal, compared in constant time."""
    return hmac.compare_digest(shown.encode(), token.encode())
