"""A calibration becomes edits on a backup."""
