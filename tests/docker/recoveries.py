"""How long what was done took, and how long it was from there until a training went on, to be printed in the end."""


class Recoveries:
    """Seconds by what was done, in the order in which it was done."""

    def __init__(self) -> None:
        self._rows: list[tuple[str, float, float | None]] = []

    def note(self, what: str, took: float, recovery: float | None = None) -> None:
        """Enter what was done, the seconds that it took, and those until the training was further than before."""
        self._rows.append((what, took, recovery))

    def lines(self) -> list[str]:
        """A table in Markdown."""
        rows = (f"| {what} | {took:.1f} | {_seconds(recovery)} |" for what, took, recovery in self._rows)
        return ["| what | took, s | then until training went on, s |", "|---|---:|---:|", *rows]

    def __len__(self) -> int:
        return len(self._rows)


def _seconds(number: float | None) -> str:
    return "" if number is None else f"{number:.1f}"


RECOVERIES = Recoveries()
