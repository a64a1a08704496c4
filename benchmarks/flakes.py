"""Which tests fail now and then on a busy machine: the slow ones, again and again, with other work beside them.

    python -m benchmarks.flakes --repetitions 20 --busy 2

Each repetition is one run of pytest whose result is a file in `--out`; a repetition that has a file is not run again.
Prints a Markdown table of the tests that failed, with how often; ends with 1 if there are any.
"""

import argparse
import multiprocessing
import subprocess
import sys
from collections import Counter
from collections.abc import Generator, Iterable, Sequence
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree as ET

from msgspec import Struct
from rich.console import Console

from benchmarks.machine import machine_kind

MARKED = "slow and not docker"


class Tally(Struct, frozen=True):
    """How often each test failed, and how many tests ran in how many repetitions."""

    failures: Counter[str]
    tests: int
    repetitions: int

    @property
    def table(self) -> str:
        """In Markdown, the most frequent failure first."""
        head = f"{self.tests} tests in {self.repetitions} repetitions, {self.failures.total()} failures"
        rows = [f"| `{name}` | {count} |" for name, count in self.failures.most_common()]
        return "\n".join([head, *(["", "| test | failures |", "|---|---|", *rows] if rows else [])])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the repetitions that are missing, and print the table."""
    options = _parser().parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    results = [options.out / f"{number:03d}.xml" for number in range(options.repetitions)]
    console = Console(stderr=True)
    with busy_processes(options.busy):
        for number, result in enumerate(results, start=1):
            if not result.exists():
                console.print(f"repetition {number} of {len(results)}", highlight=False)
                run_tests(options.paths, options.processes, result)
                console.print(tally([result]).table, highlight=False)
    found = tally(results)
    sys.stdout.write(f"{found.table}\n\n{machine_kind()}, {options.busy} busy processes beside\n")
    return 1 if found.failures else 0


@contextmanager
def busy_processes(count: int) -> Generator[None]:
    """Keep so many processes computing."""
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=_compute, daemon=True) for _ in range(count)]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.join()


def run_tests(paths: Sequence[str], processes: int, result: Path) -> None:
    """Run the slow tests once; `result` is there only if pytest came to its end."""
    aside = result.with_suffix(".part")
    options = ["-m", MARKED, "-q", "--tb=short", "--numprocesses", str(processes), "--dist", "loadfile"]
    log = result.with_suffix(".log")
    with log.open("wb") as output:
        command = [sys.executable, "-m", "pytest", *options, f"--junit-xml={aside}", *paths]
        code = subprocess.run(command, stdout=output, stderr=subprocess.STDOUT, check=False).returncode
    if code not in (0, 1):
        raise SystemExit(f"pytest ended with {code}; see {log}")
    aside.replace(result)


def tally(results: Iterable[Path]) -> Tally:
    """Count what failed in JUnit's files."""
    failures: Counter[str] = Counter()
    tests, repetitions = 0, 0
    for result in results:
        cases = list(ET.parse(result).iter("testcase"))
        failures.update(
            _name(case) for case in cases if case.find("failure") is not None or case.find("error") is not None
        )
        tests, repetitions = max(tests, len(cases)), repetitions + 1
    return Tally(failures, tests, repetitions)


def _name(case: ET.Element) -> str:
    return f"{case.get('classname')}::{case.get('name')}"


def _compute() -> None:
    number = 0
    while True:
        number = (number * 1_103_515_245 + 12_345) % 2**31


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="*", default=["tests"], help="of tests (all)")
    parser.add_argument("--repetitions", type=int, default=20, help="how often each test runs (20)")
    parser.add_argument("--busy", type=int, default=2, help="processes that compute beside the tests (2)")
    parser.add_argument("--processes", type=int, default=4, help="of pytest, as `make test` has it (4)")
    parser.add_argument("--out", type=Path, default=Path("runs/flakes"), help="for the results (runs/flakes)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
