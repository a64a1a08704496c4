"""Estimates a person's 3D pose and how sure it is: `perceive(frame, filter) -> PoseEstimate`.

`perceive.py` puts the stages in a row: `detection/` (which part of the picture the network is shown, and the person
found there), `networks/` (heatmaps and keypoints; `backend.py` opens a network, `models.py` fetches those known by
name), `lifting.py` and `lifter/` (into the world), `qoe.py` (quality), `calibration/` (errors in metres) and
`kalman.py` (the filter). `worker.py` puts them behind a socket.
"""

from perception_worker.perceive import Perceiver

__all__ = ["Perceiver"]
