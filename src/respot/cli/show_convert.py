"""A conversion on the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from respot.calibration.report import report
from respot.cli.display import Column, heading, line, table
from respot.cli.show_fit import describe, show_fit
from respot.issues import CODES

if TYPE_CHECKING:
    from respot.correction.conversion import Conversion


def show_conversion(conversion: Conversion, tolerance: float, written: Path | None, in_place: bool = False) -> None:
    """Print a conversion: the fit, what moved, what stays, what was refused, where it is."""
    if conversion.fitted is not None:
        show_fit(conversion.fitted, report(conversion.fitted.fit), tolerance)
    correction = conversion.correction
    nothing = "no file changes, nothing written" if in_place and not correction.files else "nothing written (dry run)"
    heading(f"{describe(conversion.source)}: {'written' if written else nothing}")
    _show_moved(conversion)
    for code in dict.fromkeys(stay.code for stay in correction.stays):
        names = [stay.target.name for stay in correction.stays if stay.code == code]
        line(f"  stay, {CODES[code][1].removesuffix('; it stays')}: {_some(names)}")
    for item in correction.transitions:
        line(f"  changed path, step through it: {item.start} -> {item.end} in {item.program} ({item.path}:{item.line})")
    for program in sorted(correction.refused_programs):
        line(f"  REFUSED, left as it was: program {program}")
    line("  status/turn and confdata: " + ("recomputed" if correction.reconfigured else "kept, NOT checked"))
    line("  read back and compared with what was intended: equal; every other byte is as it was")
    if correction.direction == "align":
        line("  for the cell as simulated: the real old cell must never load these files")
    else:
        line("  for the real cell: the simulation must not load these files")
    _show_effects(conversion.image.record())
    if written is not None:
        where = f"in place; the originals come back with: respot undo {written}" if in_place else f"in {written}"
        line(f"  {where} (record: {written / 'respot.json'})")


def _show_effects(record: Mapping[str, Any]) -> None:
    """What became of each effect, and what was left to the registration."""
    for key, words in (
        ("effects_written", "written into the points: leave the cause as it is"),
        ("effects_not_written", "NOT written into the points: for a person to put right"),
    ):
        if record.get(key):
            line(f"  {words}: {', '.join(record[key])}")
    if record.get("snap"):
        snap = record["snap"]
        line(
            f"  {snap['spots']} welds snapped onto their theoretical positions, by up to {snap['largest_mm']:.2f} mm "
            f"({snap['at']}); points within {snap['plateau_mm']:g} mm of a weld along the path keep their way to it"
        )
        if snap["met_by_several_ways"]:
            line(f"  {snap['met_by_several_ways']} points that several ways lead to are shifted by the mean of them")
    for each in record.get("left_to_registration", ()):
        line(
            f"  {each['base']}: of its {each['spots']} spots a rigid motion of {each['shift_mm']:.3f} mm and "
            f"{each['turn_deg']:.4f} degrees is left to the registration (--bases remeasured writes it)"
        )


def _show_moved(conversion: Conversion) -> None:
    programs: dict[str, list[float]] = {}
    for edit in conversion.correction.edits:
        if edit.depth == "point":
            programs.setdefault(edit.path, []).append(edit.shift_mm if edit.edit.reason == "point" else -1.0)
    rows = []
    for path, shifts in programs.items():
        moved = [shift for shift in shifts if shift >= 0.0]
        spread = f"{min(moved):.2f} .. {max(moved):.2f}" if moved else "-"
        rows.append([path, str(len(moved)), str(len(shifts) - len(moved)), spread])
    if rows:
        columns = [Column("file", number=False), Column("targets"), Column("offsets"), Column("moved by [mm]")]
        table(columns, rows)
    for edit in conversion.correction.edits:
        if edit.depth != "point":
            line(f"  {edit.target} ({edit.path}:{edit.line}) takes its targets along: up to {edit.shift_mm:.2f} mm")
    if not conversion.correction.edits:
        line("  no target moves: every file is as it was")


def _some(names: Iterable[str], most: int = 8) -> str:
    unique = list(dict.fromkeys(names))
    more = f" and {len(unique) - most} more" if len(unique) > most else ""
    return ", ".join(unique[:most]) + more
