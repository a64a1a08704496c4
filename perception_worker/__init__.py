"""Estimates a person's 3D pose and how sure it is: `perceive(frame, filter) -> Observation`."""
