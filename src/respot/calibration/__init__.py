"""Calibration: what was fitted, how sure it is, what it explains, and how it is kept."""

from respot.calibration.calibration import Calibration, CalibrationError
from respot.calibration.fit import fit_spots, fit_tables
from respot.calibration.spot_fit import SpotFit

__all__ = ["Calibration", "CalibrationError", "SpotFit", "fit_spots", "fit_tables"]
