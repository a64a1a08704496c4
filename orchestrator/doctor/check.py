"""The result of one check."""

from collections.abc import Iterable

from msgspec import Struct


class Check(Struct, frozen=True, kw_only=True):
    """One line of the doctor's list.

    Attributes:
        needed: whether Vantage can't run without it; otherwise it only runs slower.
        found: what the check found.
        remedy: what to do about a failure; empty where it passed.
    """

    name: str
    passed: bool
    needed: bool = True
    found: str
    remedy: str = ""


def all_needed_passed(checks: Iterable[Check]) -> bool:
    """Whether Vantage can run here."""
    return all(check.passed or not check.needed for check in checks)
