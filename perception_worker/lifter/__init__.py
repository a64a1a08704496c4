"""Where all joints of a person are, and how far off each may be, by a network that has learned it.

`evidence.py` reads the depths around keypoints, `tokens.py` tells them to a network and makes points of its answer,
`network.py` computes in numpy, `lifter.py` puts it together, `stored.py` is the file, `choice.py` finds the one that
fits. `fitting` makes one, where torch is.
"""

from perception_worker.lifter.choice import open_lifter
from perception_worker.lifter.lifter import Lifted, Lifter

__all__ = ["Lifted", "Lifter", "open_lifter"]
