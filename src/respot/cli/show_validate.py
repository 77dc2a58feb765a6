"""A validation on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from respot.cli.display import Column, heading, line, table
from respot.cli.show_fit import describe

if TYPE_CHECKING:
    from respot.calibration.validation import SourceValidation


def show_validation(found: SourceValidation) -> None:
    """Print fresh errors, spots out of tolerance, and whether the promise is kept."""
    checked = found.validation
    heading(f"{describe(found.source)} against {found.reference.path}, by the stored calibration")
    far = set(checked.out_of_tolerance)
    rows = [
        [name, f"{np.linalg.norm(residual):.2f}", *(f"{value:+.2f}" for value in residual), "OUT" * (name in far)]
        for name, residual in zip(checked.ids, checked.residuals, strict=True)
    ]
    columns = [Column("spot", number=False), *map(Column, ("error", "dx", "dy", "dz")), Column("", number=False)]
    table(columns, rows, marked=[bool(row[-1]) for row in rows])
    figures = checked.figures
    line(f"\nRMS {figures.rms:.3f}, mean {figures.mean:.3f}, max {figures.max:.3f} mm over {figures.n} spots")
    line(f"{figures.n - len(far)} of {figures.n} spots within {checked.tolerance:g} mm")
    line(checked.promise.verdict)
