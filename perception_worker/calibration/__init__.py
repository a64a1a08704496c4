"""Uncertainty in metres: an expected error, and a radius that holds the joint, fitted on people of known truth."""

from perception_worker.calibration.calibration import Calibrated, Calibration

__all__ = ["Calibrated", "Calibration"]
