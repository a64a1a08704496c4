"""What the doctor says of one thing."""

from collections.abc import Iterable

from msgspec import Struct


class Check(Struct, frozen=True, kw_only=True):
    """One line of the doctor's list.

    Attributes:
        needed: whether nothing works without it; else it is only slower.
        found: what is there.
        remedy: what to do where it failed; empty where it passed.
    """

    name: str
    passed: bool
    needed: bool = True
    found: str
    remedy: str = ""


def all_needed_passed(checks: Iterable[Check]) -> bool:
    """Whether Vantage can run here."""
    return all(check.passed or not check.needed for check in checks)
