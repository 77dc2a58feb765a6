"""Repeats: rows of one spot that a column tells apart become one row, and what they were is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.geometry import Array
from respot.issues import BadInputError, Issue
from respot.tables.columns import Title, plain_word
from respot.tables.table import Table

Rows = NDArray[np.intp]

_STEMS = (
    "repeat repetition replicate run measurement shot pass trial series wiederholung messung messreihe lauf durchlauf "
    "durchgang"
)
#: Titles of columns that number the measurements of a spot.
_WORDS = frozenset(
    f"{stem}{ending}" for stem in _STEMS.split() for ending in ("", "s", "id", "no", "nr", "number", "nummer", "index")
) | {"wiederholungsnr", "wiederholungsnummer", "messungsnr", "messungsnummer", "rep", "repno", "repnr"}
_MOST_NAMED = 3
_APART = 40.0  # mm; rows further from their mean are other spots, whatever a column says


@dataclass(frozen=True, eq=False)
class TableRepeats:
    """Every row of a table that holds spots several times.

    Parameters
    ----------
    columns : sequence of str
        Titles of the columns that tell the rows of a spot apart.
    ids : sequence of m str
        Spot of each row, spelt as in the first row of the spot.
    positions : (m, 3) array or None
        Position of each row, mm; None for a table without.
    lines : sequence of m int
        Line of each row, from 1.
    """

    columns: Sequence[str]
    ids: Sequence[str]
    positions: Array | None
    lines: Sequence[int]


def repeat_columns(titles: Sequence[Title]) -> list[Title]:
    """Titles of the columns that number the measurements of a spot: ``repeat``, ``run``, ``Messung`` and the like."""
    return [title for title in titles if plain_word(title.text) in _WORDS]


def merge_repeats(table: Table, titles: Sequence[Title]) -> Table:
    """Make one row of each spot: means of numbers and orientations, the first of texts; as it is without repeats.

    Numbers that are missing in some of the rows are the means of the others. Orientations are averaged as
    rotations (the largest eigenvector of the sum of ``q q'``: F. L. Markley and others, J. Guid. Control Dyn. 30
    (2007)).

    Parameters
    ----------
    table : Table
        One row a measurement; IDs may stand in several (compared without case).
    titles : sequence of Title
        Columns that tell them apart, as `repeat_columns` found them.

    Raises
    ------
    BadInputError
        ``DUPLICATE_ID`` where a row is more than 40 mm from the mean of its spot.
    """
    keys = [name.casefold() for name in table.ids]
    places = {key: place for place, key in enumerate(dict.fromkeys(keys))}
    if len(places) == len(keys):
        return table
    rows = np.array([places[key] for key in keys], dtype=np.intp)
    first = np.unique(rows, return_index=True)[1].astype(np.intp)
    ids = [table.ids[row] for row in first]
    said = tuple(title.text for title in titles)
    xyz = _means(table.xyz, rows)
    away = np.zeros(len(rows)) if table.xyz is None or xyz is None else np.linalg.norm(table.xyz - xyz[rows], axis=1)
    if (away > _APART).any():
        row = int(np.argmax(away))
        message = (
            f"{table.ids[row]} is {away[row]:.1f} mm from the mean of its {int(np.sum(rows == rows[row]))} rows: these "
            f"are no repeats of one spot (its column {said[0]!r} says so); find out which is right and keep that one"
        )
        raise BadInputError("DUPLICATE_ID", message, table.path, table.lines[row])
    counting = {title.name for title in titles}  # the number of a measurement says nothing about its spot
    numbers = {name: _means(values, rows) for name, values in table.numbers.items() if name not in counting}
    columns = {
        name: _texts(texts, rows, first, numbers.get(name), table.numbers.get(name))
        for name, texts in table.columns.items()
    }
    oriented = np.asarray(table.oriented, dtype=bool)
    return replace(
        table,
        ids=ids,
        xyz=xyz,
        rotations=None if table.rotations is None else _mean_rotations(table.rotations, rows, oriented),
        lines=[table.lines[row] for row in first],
        columns=columns,
        oriented=(np.bincount(rows, oriented, len(ids)) > 0).tolist() if len(oriented) else table.oriented,
        joints=_means(table.joints, rows),
        measured_joints=_means(table.measured_joints, rows),
        external_axes=_means(table.external_axes, rows),
        numbers={name: values for name, values in numbers.items() if values is not None},
        issues=[*table.issues, _issue(table, said, ids, rows, away)],
        repeats=TableRepeats(said, [ids[place] for place in rows], table.xyz, table.lines),
    )


def _means(values: Array | None, rows: Rows) -> Array | None:
    """Mean of the rows (m, ...) of each spot that are numbers; NaN where none is."""
    if values is None:
        return None
    there = np.isfinite(values)
    count, total = np.zeros((2, rows.max() + 1, *values.shape[1:]))
    np.add.at(count, rows, there)
    np.add.at(total, rows, np.where(there, values, 0.0))
    return np.where(count > 0, total / np.maximum(count, 1.0), np.nan)


def _mean_rotations(rotations: Rotation, rows: Rows, oriented: NDArray[np.bool_]) -> Rotation:
    """Mean rotation of each spot over its rows that have one; the identity where none has."""
    quaternions = rotations.as_quat()
    sums = np.zeros((rows.max() + 1, 4, 4))
    np.add.at(sums, rows, oriented[:, None, None] * quaternions[:, :, None] * quaternions[:, None, :])
    none = np.bincount(rows, oriented) == 0
    sums[none, 3, 3] = 1.0
    return Rotation.from_quat(np.linalg.eigh(sums)[1][:, :, 3])


def _texts(texts: Sequence[str], rows: Rows, first: Rows, means: Array | None, values: Array | None) -> list[str]:
    """First text of each spot that is not empty; of a covariate whose rows differ, their mean."""
    filled = np.array([bool(text) for text in texts])
    order = np.lexsort((np.arange(len(rows)), ~filled, rows))
    chosen = order[np.searchsorted(rows[order], np.arange(len(first)))]
    found = [texts[row] for row in chosen]
    if means is None or values is None:
        return found
    other = np.isfinite(means) & (means != values[chosen])
    return [f"{mean:.10g}" if differs else text for mean, differs, text in zip(means, other, found, strict=True)]


def _issue(table: Table, columns: Sequence[str], ids: Sequence[str], rows: Rows, away: Array) -> Issue:
    """Say what was averaged, and how far the rows of a spot are apart: a wrong row among them is seen there."""
    counts = np.bincount(rows)
    message = (
        f"{int(np.count_nonzero(counts > 1))} of {len(ids)} spots stand in it up to {int(counts.max())} times, told "
        f"apart by its column {' and '.join(repr(column) for column in columns)}: their means are taken"
    )
    if table.xyz is not None:
        furthest = np.zeros(len(ids))
        np.maximum.at(furthest, rows, away)
        worst = np.argsort(-furthest, kind="stable")[:_MOST_NAMED]
        message += "; furthest from their mean: " + ", ".join(f"{ids[row]} {furthest[row]:.2f} mm" for row in worst)
    return Issue("TABLE_COLUMNS", message, table.path)
