"""A process's incarnation: an id that changes when it is restarted at the same address."""

import secrets


def new_incarnation() -> str:
    """An id that no other process has, now or later."""
    return secrets.token_hex(8)
