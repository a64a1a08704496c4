"""Estimates a person's 3D pose and how sure it is: `perceive(frame, filter) -> Observation`.

`perceive.py` puts the stages in a row: `region.py` (what the network sees), `network.py` (its interface; `backend.py`
opens one), `decoding.py` (keypoints), `lifting.py` (into the world), `qoe.py` (quality), `kalman.py` (the filter).
`worker.py` puts them behind a socket; `models.py` fetches the default network.
"""

from perception_worker.perceive import Perceiver

__all__ = ["Perceiver"]
