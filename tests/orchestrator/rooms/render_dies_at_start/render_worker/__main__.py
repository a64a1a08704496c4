import logging
import sys

from protocol.system.logs import configure

configure("render")
logging.getLogger(__name__).error("no EGL display; install libegl1")
sys.exit(2)
