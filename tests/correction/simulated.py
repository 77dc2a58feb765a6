"""Simulated lines on disk, converted, and run once more with the programs that came out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from respot.calibration.source_fit import FitOptions
from respot.correction.conversion import Conversion, convert, record_of
from respot.correction.options import CorrectionOptions
from respot.output import write_backup
from respot.simulation import Landing, Line, files_of, rerun, simulate
from respot.simulation.line import rigid_rest, rms
from respot.spots import read_source
from tests.difference.witness import assert_witnessed

KUKA, ABB = "kr210_r2700_extra", "irb6700_200_260"
NOISE = 0.1


@dataclass(frozen=True)
class Cell:
    """A line and its folder."""

    line: Line
    effects: tuple[str, ...]
    folder: Path

    @property
    def backup(self) -> Path:
        return self.folder / "backup"

    @property
    def measured(self) -> Path:
        return self.folder / "measured.csv"

    def told(self, backup: Path) -> tuple[np.ndarray, Rotation]:
        """Poses of the spots in the programs of a backup, in the order of the line."""
        spots = read_source(backup, self.line.ids).spots
        rows = [spots.ids.index(name) for name in self.line.ids]
        return spots.positions[rows], spots.rotations[rows]

    def run(self, backup: Path) -> Landing:
        return rerun(self.line, self.effects, *self.told(backup))

    def error(self, backup: Path) -> float:
        """RMS of where the spots land against where the old programs said, after the best registration [mm]."""
        return rms(rigid_rest(self.told(self.backup)[0], self.run(backup).positions))

    def convert(
        self, out: Path, effects, source: Path | None = None, calibration: Path | None = None, **options
    ) -> Conversion:
        fit = FitOptions(kind="measured", noise=NOISE, effects=effects)
        start = source or self.backup
        reference = self.measured if calibration is None else None
        made = convert(start, reference, calibration, fit, CorrectionOptions(**options))
        write_backup(out, made.files, made.correction, record_of(made), False)
        assert_witnessed(made.as_json()["edits"], start, out)
        return made


def cell(folder: Path, robot: str, *effects: str, seed: int = 1, spots: int = 60, rail: bool = False) -> Cell:
    line = simulate(robot, spots, NOISE, effects, seed, rail=rail or "rail" in effects)
    for path, content in files_of(line).items():
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
    return Cell(line, effects, folder)


def model_error(made: Conversion, line: Line) -> float:
    """RMS by which a fitted calibration misses the truth at its spots: what it can reach at best [mm]."""
    fit = made.fitted.fit
    return rms(rigid_rest(fit.calibrated, line.measured_true[[line.ids.index(name) for name in fit.ids]]))
