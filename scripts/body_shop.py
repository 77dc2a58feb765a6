"""Four calibration records of a body shop, fitted with a rigid part and a tool offset: ``body_shop.py FOLDER``.

The folder holds pairs ``NAME_programmed.csv`` (poses) and ``NAME_measured.csv`` (points). For each: spots, in-sample
and leave-one-out RMS, the offset with its 95 % intervals; all spots by least squares, and what the robust fit keeps.
Then what deleting the worst spot, again and again, does to the two errors: the first falls by itself, the second
tells ("one spot alone": it determines a part of the model by itself), and the last column says how far the deleted
spots are from where the rest puts them.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.effects.tool_fit import ToolFit, fit_tool, leave_one_out_tool
from respot.calibration.source_fit import FitOptions, fit_source
from respot.calibration.spot_fit import SpotFit
from respot.registration.statistics import rms

DELETIONS = 7


def fitted(folder: Path, name: str) -> SpotFit:
    """Fit a record as `respot fit --measured` does."""
    options = FitOptions(kind="measured", effects="auto")
    return fit_source(folder / f"{name}_programmed.csv", folder / f"{name}_measured.csv", options).fit


def tools_of(fit: SpotFit) -> NDArray[np.float64]:
    """Tool orientations (n, 3, 3) of a record."""
    if fit.source_rotations is None:
        sys.exit("the poses have no orientations")
    return fit.source_rotations.as_matrix()


def row(title: str, fit: ToolFit, tools: NDArray[np.float64]) -> str:
    """Line of the table."""
    left = leave_one_out_tool(fit, tools)
    reach = stats.t.ppf(0.975, fit.degrees_of_freedom) * np.sqrt(np.diag(fit.covariance)[6:])
    offset = "  ".join(f"{value:8.2f} +- {half:5.2f}" for value, half in zip(fit.offset, reach, strict=True))
    kept = fit.inliers
    worst = float(np.linalg.norm(left[kept], axis=1).max())
    return (
        f"{title:26} {int(kept.sum()):3} {rms(fit.residuals[kept]):9.3f} {rms(left[kept]):9.3f} {worst:9.3f}   {offset}"
    )


def deletions(fit: SpotFit, tools: NDArray[np.float64]) -> None:
    """Delete the spot with the largest residual, seven times over."""
    kept = np.ones(len(fit.ids), dtype=np.bool_)
    print(f"  {'deleted':12} {'left':>4} {'in-sample':>10} {'leave-one-out':>14} {'RMS of the deleted':>19}")
    name = "none"
    for _ in range(DELETIONS + 1):
        found = fit_tool(fit.source, tools, fit.reference, kept)
        left = leave_one_out_tool(found, tools)
        gone = f"{rms(found.residuals[~kept]):19.3f}" if not kept.all() else f"{'-':>19}"
        held = rms(left[kept])
        said = f"{held:14.3f}" if np.isfinite(held) else f"{'one spot alone':>14}"
        print(f"  {name:12} {int(kept.sum()):4} {rms(found.residuals[kept]):10.3f} {said} {gone}")
        worst = int(np.argmax(np.where(kept, np.linalg.norm(found.residuals, axis=1), -1.0)))
        kept[worst], name = False, fit.ids[worst]


def main(folder: Path) -> None:
    """Print the table."""
    suffix = "_programmed.csv"
    names = sorted(path.name.removesuffix(suffix) for path in folder.glob(f"*{suffix}"))
    head = f"{'record':26} {'n':>3} {'in-sample':>9} {'leave-1':>9} {'worst':>9}   offset in the tool frame, 95 %"
    print("RMS and worst distance in mm\n" + head)
    fits = {name: fitted(folder, name) for name in names}
    for name, fit in fits.items():
        tools = tools_of(fit)
        print(row(name, fit_tool(fit.source, tools, fit.reference), tools))
        if fit.tool is not None and fit.tool.accepted and fit.tool.fit is not None and not fit.robust.inliers.all():
            print(row("  inliers of respot fit", fit.tool.fit, tools))
    for name, fit in fits.items():
        print(f"\n{name}: the worst spot deleted, again and again")
        deletions(fit, tools_of(fit))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
