"""Finds the person in a camera's picture: which part of it the network is shown, and which skeleton is the person's.

`detectors.py` has the two detectors: one shows the network the whole frame, one tracks with the filter. `detection.py`
is one run of the network and its result, `expectation.py` where the filter expects the person, `region.py` the
rectangle that shows a person, and `pictures.py` where pictures and parts of them come from.
"""

from perception_worker.detection.detection import Detection
from perception_worker.detection.detectors import Detector, TrackingDetector, WholeFrameDetector
from perception_worker.detection.pictures import HeldPictures, Pictures

__all__ = ["Detection", "Detector", "HeldPictures", "Pictures", "TrackingDetector", "WholeFrameDetector"]
