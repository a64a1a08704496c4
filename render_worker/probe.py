"""`python -m render_worker.probe` tells whether a render worker runs here; `orchestrator doctor` calls it."""

import sys
from contextlib import closing

from protocol.config import RenderConfig
from protocol.system.command import run_command
from render_worker.renderer import open_renderer
from render_worker.worker import warm_up


def main() -> int:
    """Open what a worker with default settings opens, and draw a picture; returns the exit code."""
    return run_command(_draw)


def _draw() -> None:
    with closing(open_renderer(RenderConfig())) as renderer:
        warm_up(renderer)
    sys.stdout.write("a person in a room was drawn\n")


if __name__ == "__main__":
    sys.exit(main())
