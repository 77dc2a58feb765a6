"""The paper's method, and the unconstrained solution, on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from respot.cli.display import Column, heading, line, table

if TYPE_CHECKING:
    from respot.calibration.spot_fit import SpotFit


def show_paper(fit: SpotFit) -> None:
    """Print what the paper's method chose and dropped, what it left unsaid, and how far it is from our fit."""
    paper, other, ours = fit.paper, fit.paper_mean_square, fit.beside
    if paper is None or other is None or ours is None:
        return
    heading("the paper's method: equations (5) to (8)")
    which = "all" if paper.exhaustive else "random"
    line(f"  {paper.n_subsets} subsets of {paper.subset_size} spots ({which}), {paper.n_degenerate} of them on a line")
    line(
        f"  {paper.n_qualified} leave more than N_min = {paper.n_min} other spots within tau = {paper.tau:g} mm "
        "(the paper states neither; see --tau, --n-min)"
    )
    line(f"  chosen:  {_names(fit, paper.subset)}")
    line(f"  drops:   {_names(fit, paper.dropped)}")
    if paper.beyond:
        line(f"  but its own {_names(fit, paper.beyond)} lie beyond tau: the method never tests the subset itself")
    line(f"  D_n = {paper.d_n:.4f} mm2, the variance of delta over {len(paper.inliers)} inliers outside the subset")
    if paper.runner_up is not None:
        line(
            f"  place {paper.runner_up.rank}: D_n = {paper.runner_up.d_n:.4f} mm2 drops "
            f"{_names(fit, paper.runner_up.dropped)}"
        )
    line(f"  with D_n as a mean square (the other reading): {other.d_n:.4f} mm2, drops {_names(fit, other.dropped)}")
    apart = np.linalg.norm(fit.calibrated - ours.calibrated, axis=1)
    ours_dropped = [row for row in range(len(fit.ids)) if not ours.robust.inliers[row]]
    line(
        f"  robust:  drops {_names(fit, ours_dropped)}; the two transforms put spots {apart.mean():.2f} mm apart in the"
    )
    line(f"           mean, {apart.max():.2f} mm at most ({fit.ids[int(np.argmax(apart))]})")


def show_affine(fit: SpotFit) -> None:
    """Print the unconstrained solution: what it swallows beside a rotation."""
    affine = fit.affine
    if affine is None:
        return
    heading("12 free parameters, equation (6) of the paper: for comparison only, no program is corrected by it")
    for row in affine.matrix[:3]:
        line("  " + " ".join(f"{value:10.6f}" for value in row[:3]) + f" {row[3]:12.3f}")
    stretches = ", ".join(f"{value:.4f}" for value in affine.stretches)
    line(f"  stretches {stretches} (a rotation: 1, 1, 1); shear {affine.shear:.2f} degrees")
    line(f"  entries differ from the nearest rotation's by up to {affine.departure:.4f}")
    thin, long = affine.spread[2], affine.spread[0]
    line(f"  the spots extend {thin:.1f} mm (RMS) in their thinnest direction, {long:.1f} mm in their longest")
    lengths = np.linalg.norm(affine.residuals, axis=1)
    table(
        [Column("spot", number=False), Column("residual [mm]")],
        [[name, f"{length:.2f}"] for name, length in zip(fit.ids, lengths, strict=True)],
    )
    root = float(np.sqrt(np.mean(lengths**2)))
    held_out = float(np.sqrt(np.mean(np.sum(affine.leave_one_out**2, axis=1))))
    line(
        f"  RMS {root:.3f}, mean {lengths.mean():.3f}, max {lengths.max():.3f} mm; leave-one-out RMS {held_out:.3f} mm"
    )
    line("  what follows is the robust rigid fit of the same pairs")


def _names(fit: SpotFit, rows: Sequence[int]) -> str:
    return ", ".join(fit.ids[row] for row in rows) or "none"
