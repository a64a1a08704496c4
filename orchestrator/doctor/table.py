"""The doctor's checks as a table."""

from collections.abc import Iterable

from rich.table import Table
from rich.text import Text

from orchestrator.doctor.check import Check


def checks_table(checks: Iterable[Check]) -> Table:
    """One line a check, and below each failed one what to do."""
    table = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
    table.add_column()
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for check in checks:
        mark = (
            Text("ok", "green")
            if check.passed
            else Text("FAILED", "bold red")
            if check.needed
            else Text("slow", "yellow")
        )
        table.add_row(mark, Text(check.name), Text(check.found))
        if check.remedy:
            table.add_row("", "", Text(f"→ {check.remedy}", "bold"))
    return table
