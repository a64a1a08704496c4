"""Finds that it can't work, says why, and ends."""

import logging
import sys

from protocol.system.logs import configure

configure("render")
logging.getLogger(__name__).info("about to load the bodies")
logging.getLogger(__name__).error("bodies-v1.npz is missing; make it with 'orchestrator bodies bake'")
sys.exit(2)
