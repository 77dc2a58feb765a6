"""What came of a line as one record, as a table, and as a page. Clock times are left to the ledger.

The same inputs and options give the same bytes, however often a run was interrupted.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from math import sqrt
from typing import Any

from respot import __version__
from respot.figures.line_page import line_page
from respot.line.fleet import fleet_of, label_of
from respot.line.folder import ROBOTS, OutputFolder
from respot.line.groups import groups_of
from respot.line.jobs import JobResult
from respot.line.line_file import LineFile, LineRobot
from respot.line.work import PAGE, PROGRAMS

RECORD, TABLE, INDEX = "line.json", "line.csv", "index.html"
_COLUMNS = (
    "name", "state", "kind", "language", "model", "generation", "group", "station", "gun", "spots", "before", "after",
    "heldout", "effects", "edits", "refused", "note",
)  # fmt: skip


def write_summary(line: LineFile, rows: Iterable[Mapping[str, Any]], folder: OutputFolder) -> None:
    """Write ``line.json``, ``line.csv`` and ``index.html``.

    Raises
    ------
    BadInputError
        ``CANNOT_WRITE``: one cannot be written.
    """
    record = line_record(line.name, rows)
    folder.write(RECORD, json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    folder.write(TABLE, table(record["robots"]))
    folder.write(INDEX, line_page(record))


def line_record(name: str, rows: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Record of a line, INTERFACES `migrate`, without times and issues.

    Parameters
    ----------
    name : str
        Of the line.
    rows : iterable of mapping
        As `Ledger.rows` gives them.
    """
    robots = [robot_record(row) for row in rows]
    fleet, groups = fleet_of(robots), groups_of(robots)
    for robot in robots:  # as long as all the rest, and in the ledger and the calibrations
        robot["effects"] = [{key: effect[key] for key in effect if key not in _LONG} for effect in robot["effects"]]
    return {
        "schema": "respot.migrate/1",
        "version": __version__,
        "line": name,
        "robots": robots,
        "totals": totals(robots),
        "fleet": fleet,
        "groups": groups,
    }


def robot_record(row: Mapping[str, Any]) -> dict[str, Any]:
    """What the record says of one robot."""
    figures, traits = row["figures"], row["traits"]
    name, done = row["name"], row["state"] == "done"
    failed = {"code": row["code"], "message": row["error"]} if row["code"] else None
    return {
        "name": name,
        "state": row["state"],
        "kind": figures.get("kind"),
        "direction": figures.get("direction"),
        "language": figures.get("language", ""),
        "model": figures.get("model", ""),
        "generation": traits.get("generation") or figures.get("version", ""),
        "group": traits.get("group", ""),
        "station": traits.get("station", ""),
        "gun": traits.get("gun", ""),
        "spots": figures.get("spots"),
        "before": figures.get("before"),
        "after": figures.get("after"),
        "heldout": figures.get("heldout"),
        "unexplained": figures.get("unexplained", False),
        "effects": row["effects"],
        "edits": figures.get("edits", 0),
        "refused": figures.get("refused", []),
        "error": failed,
        "note": figures.get("note", ""),
        "programs": f"{ROBOTS}/{name}/{PROGRAMS}" if done and figures.get("programs") else None,
        "page": f"{ROBOTS}/{name}/{PAGE}" if done and figures.get("spots") is not None else None,
    }


def row_of(robot: LineRobot, result: JobResult) -> dict[str, Any]:
    """Row, as the ledger gives them, of a result that no ledger holds: of a dry run."""
    return {
        "name": robot.name,
        "state": "dry-run" if result.state == "done" else result.state,
        "code": result.code,
        "error": result.error,
        "figures": result.figures,
        "traits": {"group": robot.group, **robot.traits},
        "effects": list(result.effects),
    }


def totals(robots: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Sums over a line; errors are RMS over all spots."""
    fitted = [robot for robot in robots if robot["spots"] is not None]
    spots = sum(robot["spots"] for robot in fitted)

    def rms(key: str) -> float | None:
        return sqrt(sum(robot["spots"] * robot[key] ** 2 for robot in fitted) / spots) if spots else None

    return {
        "robots": len(robots),
        **{state: sum(robot["state"] == state for robot in robots) for state in _STATES},
        "spots": spots,
        "before": rms("before"),
        "after": rms("after"),
        "with_effects": sum(bool(robot["effects"]) for robot in robots),
        "edits": sum(robot["edits"] for robot in robots),
        "refused": sum(len(robot["refused"]) for robot in robots),
    }


_LONG = ("covariance", "form")
_STATES = ("done", "failed", "waiting", "running")


def table(robots: Sequence[Mapping[str, Any]]) -> str:
    """The robots as CSV; lengths to a thousandth of a millimetre."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for robot in robots:
        told = {
            **robot,
            "effects": "; ".join(label_of(effect) for effect in robot["effects"]),
            "refused": "; ".join(robot["refused"]),
            "note": robot["note"] if robot["error"] is None else "{code} {message}".format(**robot["error"]),
        }
        writer.writerow([_cell(told[column]) for column in _COLUMNS])
    return out.getvalue()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.3f}" if isinstance(value, float) else str(value)
