"""What a monitor may do beyond looking, if it knows the token: end the process in order."""

import hmac
from collections.abc import Mapping
from pathlib import Path

from protocol.errors import NotPermitted
from protocol.security.secret_file import read_secret

TOKEN_VARIABLE = "VANTAGE_HTTP_TOKEN"
"""Where the option `--http-token` is not given, the environment may name the file."""

_SHORTEST = 16
_HINT = "'openssl rand -hex 32' makes one"


def token_from(file: Path | None, environment: Mapping[str, str]) -> str:
    """The token that control calls need; empty where none may be made.

    Raises:
        NotPermitted: the file that was named can't be read, is open to others, or its token is easily guessed.
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
        raise NotPermitted(f"{file} is no token: it has other characters than ASCII") from error
    if len(token) < _SHORTEST or not token.isprintable() or " " in token:
        raise NotPermitted(f"{file} holds no token: {_SHORTEST} characters or more without a space are one; {_HINT}")
    return token


def is_same(shown: str, token: str) -> bool:
    """Whether a token is the right one; how long this takes tells nothing of it."""
    return hmac.compare_digest(shown.encode(), token.encode())
