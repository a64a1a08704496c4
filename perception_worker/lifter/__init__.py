"""The positions of all joints of a person, and how far off each may be, by a learned network.

`evidence.py` reads the depths around keypoints, `tokens.py` makes a network's input of them and points of its output,
`network.py` computes in numpy, `lifter.py` puts it together, `stored.py` is the file, `choice.py` finds the lifter that
fits a worker. `fitting` makes one, and needs torch.
"""

from perception_worker.lifter.choice import open_lifter
from perception_worker.lifter.lifter import Lifted, Lifter

__all__ = ["Lifted", "Lifter", "open_lifter"]
