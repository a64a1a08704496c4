"""`python -m render_worker.probe`: whether a render worker would work here. `orchestrator doctor` runs it."""

import sys
from contextlib import closing

from protocol.config import RenderConfig
from protocol.system.command import run_command
from render_worker.renderer import open_renderer
from render_worker.worker import warm_up


def main() -> int:
    """Open what a worker opens that is told nothing, and draw a picture; returns the exit code."""
    return run_command(_draw)


def _draw() -> None:
    with closing(open_renderer(RenderConfig())) as renderer:
        warm_up(renderer)
    sys.stdout.write("a person in a room was drawn\n")


if __name__ == "__main__":
    sys.exit(main())
