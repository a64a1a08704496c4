"""`python -m perception_worker`."""

import sys

from perception_worker.worker import main

sys.exit(main())
