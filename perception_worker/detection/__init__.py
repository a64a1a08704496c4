"""Finds the person in a camera's picture: which part of it the network is shown, and which skeleton is the person's.

`choice.py` opens the detector that a configuration names. `detectors.py` has the two: one shows the network the whole
frame, one tracks with the filter. `detection.py` is one run of the network and its result, `expectation.py` where the
filter expects the person, `region.py` the rectangle that shows a person, and `pictures.py` where pictures come from.
"""

from perception_worker.detection.detection import Detection
from perception_worker.detection.detectors import Detector, TrackingDetector, WholeFrameDetector
from perception_worker.detection.pictures import HeldPictures, Pictures

__all__ = ["Detection", "Detector", "HeldPictures", "Pictures", "TrackingDetector", "WholeFrameDetector"]
