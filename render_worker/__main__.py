"""`python -m render_worker --bind ADDRESS [--config FILE] [--orchestrator ADDRESS --name NAME]`."""

import sys

from render_worker.worker import main

if __name__ == "__main__":
    sys.exit(main())
