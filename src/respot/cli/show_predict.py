"""A prediction on the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from respot.cli.display import Column, heading, line, table
from respot.cli.show_fit import describe

if TYPE_CHECKING:
    from respot.calibration.prediction import SourcePrediction


def show_prediction(predicted: SourcePrediction, written: Path | None) -> None:
    """Print where each spot will be, and how sure that is."""
    found, model = predicted.prediction, predicted.calibration
    where = "should be, as planned" if model.kind == "theory" else "really goes, as measured"
    heading(f"{describe(predicted.source)}: where it {where} (reference frame, mm, degrees)")
    columns = [Column("spot", number=False), *map(Column, ("x", "y", "z"))]
    columns += [Column(name) for name in "abc" if found.rotations is not None]
    columns += [Column("95 % +-"), Column("new +-"), Column("leverage"), Column("", number=False)]
    rows = []
    for spot in found.to_dict():
        cells = [spot["id"], *(f"{spot[axis]:.2f}" for axis in "xyz")]
        cells += [f"{spot[angle]:.3f}" for angle in "abc" if found.rotations is not None]
        cells += ["-" if spot[name] is None else f"{spot[name]:.2f}" for name in ("ci95", "ci95_new")]
        cells += ["-" if spot["leverage"] is None else f"{spot['leverage']:.2f}"]
        rows.append([*cells, "outside" if spot["extrapolated"] else ""])
    table(columns, rows, marked=[bool(row[-1]) for row in rows])
    if found.ci95 is not None:
        line(
            "95 % +-: radius of the ball around a spot, by the fitted parameters; new +-: for one new measurement of it"
        )
        line("intervals hold given the model and the spots it was fitted to; outside of these nothing tests them")
    if written is not None:
        line(f"\nwritten {written}")
