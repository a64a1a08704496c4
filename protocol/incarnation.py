"""The name of one life of a process: started again at the same address, it has another."""

import secrets


def new_incarnation() -> str:
    """A name that no other process has, now or later."""
    return secrets.token_hex(8)
