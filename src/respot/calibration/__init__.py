"""Calibration: what was fitted, how sure it is, what it explains, and how it is kept."""

from respot.calibration.calibration import Calibration, CalibrationError
from respot.calibration.fit import SpotFit, fit_spots, fit_tables

__all__ = ["Calibration", "CalibrationError", "SpotFit", "fit_spots", "fit_tables"]
