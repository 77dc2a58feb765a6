"""A fit on the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from respot.cli.display import Column, heading, line, table, terminal_width
from respot.cli.show_causes import show_causes
from respot.cli.show_method import show_affine, show_paper
from respot.cli.show_tool import show_tool
from respot.languages import LANGUAGES
from respot.registration.matching import PLACE

if TYPE_CHECKING:
    from respot.calibration.source_fit import SourceFit
    from respot.calibration.spot_fit import SpotFit
    from respot.geometry import Array
    from respot.spots import Source

#: Widths of the terminal from which the table of spots shows coordinates, and components of the errors beside them.
_COORDINATES, _EVERYTHING = 124, 150


def show_fit(
    fitted: SourceFit, record: Mapping[str, Any], tolerance: float, saved: Path | None = None, page: Path | None = None
) -> None:
    """Print a fit: spots, errors, transform, what was found.

    Parameters
    ----------
    fitted : SourceFit
    record : mapping
        The same as JSON values.
    tolerance : float
        [mm]
    saved, page : Path, optional
        Where the calibration and the result page were written.
    """
    fit = fitted.fit
    kind = "should be" if fit.model.kind == "theory" else "really went"
    heading(f"{describe(fitted.source)} against {fitted.reference.path} (where it {kind})")
    matched = "geometry" if fit.match is not None and PLACE in fit.match.rules else "ID"
    counts = f"{len(fitted.source.spots.ids)} spots in the source, {len(fitted.reference.spots.ids)} in the reference"
    out = f", {len(fit.heldout.ids)} held out" if fit.heldout is not None else ""
    line(f"{counts}{out}, {len(fit.ids)} matched by {matched}, {int(fit.robust.inliers.sum())} inliers")
    if fit.method == "affine":
        show_affine(fit)
    line()
    _show_spots(fit)
    _show_errors(fit, tolerance)
    _show_transform(fit)
    show_tool(fit)
    if fit.method == "paper":
        show_paper(fit)
    _show_noise(fit)
    beside = record.get("robust")
    show_causes(fit.beside or fit, beside if isinstance(beside, Mapping) else record)
    for path in (saved, page):
        if path is not None:
            line(f"\nsaved {path}")


def describe(source: Source) -> str:
    """Name a source: the robot with its language and model, or the table."""
    robot = source.robot
    if robot is None:
        return str(source.path)
    model = f", {robot.machine.model}" if robot.machine.model else ""
    return f"{robot.name} ({LANGUAGES[robot.language].title}{model})"


def _show_spots(fit: SpotFit) -> None:
    width = terminal_width()
    wide, components = width >= _COORDINATES, width < _COORDINATES or width >= _EVERYTHING
    calibrated, as_found = fit.calibrated, np.linalg.norm(fit.as_found, axis=1)
    after = np.linalg.norm(fit.robust.rigid.residuals, axis=1)
    columns = [Column("spot", number=False)]
    columns += [Column("theoretical x, y, z" if fit.model.kind == "theory" else "measured x, y, z")] * wide
    columns += [Column("actual x, y, z")] * wide + [Column("as found")]
    columns += [Column("calibrated x, y, z")] * wide
    columns += [Column("after")] + [Column(title) for title in ("dx", "dy", "dz")] * components
    columns += [Column("inlier", number=False)]
    rows = []
    for row, name in enumerate(fit.ids):
        cells = [f"{name} *" if fit.repaired[row] else name]
        cells += [_point(fit.reference[row]), _point(fit.source[row])] if wide else []
        cells += [f"{as_found[row]:.2f}"]
        cells += [_point(calibrated[row])] if wide else []
        cells += [f"{after[row]:.2f}"]
        cells += [f"{value:+.2f}" for value in fit.robust.rigid.residuals[row]] if components else []
        cells += ["yes" if fit.robust.inliers[row] else "no"]
        rows.append(cells)
    table(columns, rows, marked=[bool(value) for value in fit.repaired])
    for name, other, repaired in zip(fit.ids, fit.reference_ids, fit.repaired, strict=True):
        if repaired:
            line(f"* {name} lies at the place that the reference calls {other}; 'as found' takes the names as given")


def _point(point: Array) -> str:
    return " ".join(f"{value:8.2f}" for value in point)


def _show_errors(fit: SpotFit, tolerance: float) -> None:
    heading("errors [mm]")
    rigid, inliers = fit.robust.rigid.residuals, fit.robust.inliers
    kept = "names exchanged back" if fit.repaired.any() else "names as given"
    after = "the paper's transform" if fit.method == "paper" else "rigid"
    if fit.weighted is not None:
        after = "rigid, weighed by direction"
    if fit.oriented is not None:
        after = "rigid, orientations fitted too"
    if fit.model.tool_offset is not None:
        after = "rigid with a tool offset"
    if fit.model.terms:
        after = f"rigid with {', '.join(dict.fromkeys(term.effect for term in fit.model.terms))}"
    rows = [
        _errors("as found, no transform", fit.as_found),
        _errors("before: rigid, all spots, names as given", fit.before.residuals),
        _errors(f"after: {after}, {int(inliers.sum())} inliers, {kept}", rigid[inliers]),
        _errors("leave-one-out before", fit.before_loo),
        _errors("leave-one-out after", fit.after_loo),
        *_nested(fit),
        *_heldout(fit),
        _errors("for comparison: translation alone", fit.translation.residuals),
    ]
    if fit.method == "paper" and fit.beside is not None:
        ours = fit.beside
        names = "names exchanged back" if ours.repaired.any() else "names as given"
        rows.append(
            _errors(
                f"for comparison: robust, {int(ours.robust.inliers.sum())} inliers, {names}",
                ours.robust.rigid.residuals[ours.robust.inliers],
            )
        )
    if fit.affine is not None:
        rows.append(_errors("for comparison: 12 free parameters, names as given", fit.affine.residuals))
    table([Column("", number=False), Column("RMS"), Column("mean"), Column("max"), Column("n")], rows)
    within = int((np.linalg.norm(rigid, axis=1) <= tolerance).sum())
    line(f"{within} of {len(fit.ids)} spots within {tolerance:g} mm after")
    if fit.heldout is not None:
        for name, other, repaired in zip(fit.heldout.ids, fit.heldout.reference_ids, fit.heldout.repaired, strict=True):
            if repaired:
                line(f"{name}, held out, lies at the place that the reference calls {other}, and is judged there")


def _nested(fit: SpotFit) -> list[list[str]]:
    """Errors of spots that took no part in choosing or fitting."""
    found = fit.discovery
    if not fit.model.terms or found is None or found.nested is None:
        return []
    judged = np.isfinite(found.nested).all(axis=1) & fit.robust.inliers
    return [_errors("each fifth left out of choosing and fitting", found.nested[judged])]


def _heldout(fit: SpotFit) -> list[list[str]]:
    """Errors of spots that were kept out from the start."""
    if fit.heldout is None:
        return []
    after = "names exchanged back" if fit.heldout.repaired.any() else "names as given"
    return [
        _errors("held out before: rigid of the others, names as given", fit.heldout.before),
        _errors(f"held out after: final model of the others, {after}", fit.heldout.after),
    ]


def _errors(title: str, vectors: Array) -> list[str]:
    lengths = np.linalg.norm(vectors, axis=1)
    if not np.isfinite(lengths).all():
        return [title, "-", "-", "-", str(len(lengths))]
    root = float(np.sqrt((lengths**2).mean()))
    return [title, f"{root:.3f}", f"{lengths.mean():.3f}", f"{lengths.max():.3f}", str(len(lengths))]


def _show_transform(fit: SpotFit) -> None:
    heading("transform, source to reference (95 % intervals)")
    inliers = fit.robust.inliers
    moved = (fit.calibrated[inliers] - fit.source[inliers]).mean(axis=0)
    turned = np.degrees(fit.model.source2reference.rotation.as_rotvec())
    half = fit.uncertainty.half_width[:6]
    for name, value, width in zip("xyz", moved, half[:3], strict=True):
        line(f"  the spots' centre moves in {name} by {value:8.3f} +- {width:.3f} mm")
    for name, value, width in zip("xyz", turned, half[3:], strict=True):
        line(f"  it turns about {name}         by {value:8.4f} +- {width:.4f} degrees")
    line(f"  {fit.support.verdict}")
    if fit.oriented is not None:
        part = fit.oriented
        line(
            f"  {int(part.agree.sum())} of {len(part.agree)} orientations took part: positions count by a noise of "
            f"{part.sigma_mm:.3f} mm, orientations by {part.sigma_deg:.3f} degrees"
        )
    if fit.weighted is not None:
        sd = np.sqrt(np.diag(fit.weighted.noise))
        line(f"  residuals count by a noise of {sd[0]:.2f} / {sd[1]:.2f} / {sd[2]:.2f} mm in x / y / z")


def _show_noise(fit: SpotFit) -> None:
    if fit.orientations is not None:
        line(f"  {fit.orientations.verdict}")
    sure = fit.uncertainty
    if sure.by_direction and sure.isotropy_p is not None:
        line(
            f"  the noise is not the same along all axes (p = {sure.isotropy_p:.3f}): the intervals above take each "
            "direction by itself"
        )
    sd = fit.directions.sd_xyz
    axis = fit.directions.axes[int(np.argmax(fit.directions.sd))]
    along = "xyz"[int(np.argmax(np.abs(axis)))]
    line(
        f"  residuals spread {sd[0]:.1f} / {sd[1]:.1f} / {sd[2]:.1f} mm in x / y / z: "
        f"mostly along {along}; a spread along one direction of the part is how people space spots by hand"
        if sd.max() > 2.0 * np.sort(sd)[1]
        else f"  residuals spread {sd[0]:.1f} / {sd[1]:.1f} / {sd[2]:.1f} mm in x / y / z, alike in all directions"
    )
