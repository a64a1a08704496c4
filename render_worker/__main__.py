"""`python -m render_worker --bind ADDRESS [--config FILE] [--orchestrator ADDRESS --name NAME] [--http PORT]`."""

import sys

from render_worker.worker import main

if __name__ == "__main__":
    sys.exit(main())
