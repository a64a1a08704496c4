"""`python -m perception_worker.next_view TABLE --output FILE`: fits every way of choosing, and writes its choices."""

import argparse
import logging
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.artifact import require_place
from protocol.errors import Unavailable
from protocol.system.command import run_command

if TYPE_CHECKING:
    from perception_worker.next_view.choices import Choices

_logger = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit and choose; returns the exit code."""
    parser = argparse.ArgumentParser(prog="perception_worker.next_view", description="Chooses the next view.")
    parser.add_argument("table", type=Path, metavar="TABLE", help="of 'orchestrator experiment next-view'")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE", help="where to write the choices")
    parser.add_argument("--seeds", type=int, default=5, help="trainings of each way of choosing (default: 5)")
    chosen = parser.parse_args(arguments)
    return run_command(lambda: _choose(chosen.table, chosen.output, range(chosen.seeds)))


def _choose(table: Path, output: Path, seeds: Sequence[int]) -> None:
    try:
        import torch

        from perception_worker.next_view.arrays import read_arrays
        from perception_worker.next_view.choices import write_choices
        from perception_worker.next_view.ways import all_choices
    except ImportError as error:
        raise Unavailable(f"fitting needs the extra 'lifter': {error}") from error
    require_place(output)
    torch.set_num_threads(1)
    arrays = read_arrays(table)
    _logger.info("lifting the people of %d scenes", len(arrays))
    write_choices(output, arrays, _told(all_choices(arrays, seeds)))
    _logger.info("wrote %s", output)


def _told(all_choices: "Iterable[Choices]") -> "Iterator[Choices]":
    for choices in all_choices:
        _logger.info("%s: %s, seed %d", choices.group, choices.method, choices.seed)
        yield choices


if __name__ == "__main__":
    sys.exit(main())
