"""Goes on as if nobody had asked it to stop, and has a child that does the same."""

import signal
import subprocess
import sys
import time

signal.signal(signal.SIGTERM, signal.SIG_IGN)
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
sys.stdout.write(f"{child.pid}\n")
sys.stdout.flush()
time.sleep(600)
