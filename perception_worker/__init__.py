"""Estimates a person's 3D pose and how sure it is: `perceive(frame, filter) -> PoseEstimate`.

`perceive.py` puts the stages in a row: `region.py` (what the network sees), `network.py` (heatmaps and keypoints,
whichever network it is; `backend.py` opens one), `lifting.py` (into the world), `qoe.py` (quality), `kalman.py` (the
filter). `worker.py` puts them behind a socket; `models.py` fetches the networks known by name.
"""

from perception_worker.perceive import Perceiver

__all__ = ["Perceiver"]
