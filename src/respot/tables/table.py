"""What a spot table holds, as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from scipy.spatial.transform import Rotation

from respot.geometry import Array
from respot.issues import BadInputError, Issue

if TYPE_CHECKING:
    from respot.tables.repeats import TableRepeats


@dataclass(frozen=True, eq=False)
class Table:
    """A spot table.

    Parameters
    ----------
    path : str
        As the user named it.
    ids : sequence of str
        Spot IDs, each once (compared without case).
    xyz : (n, 3) array or None
        mm, whatever the table's unit; None for a table of joints or covariates only.
    rotations : Rotation or None
        Batch of n, identity where a row has no orientation; None where no row has one.
    lines : sequence of int
        Line of each row, from 1.
    columns : mapping of str to sequence of str
        Every column as text, by its canonical name or its header in lower case.
    sha256 : str
        Hash of what was read: a CSV's text, an XLSX's bytes.
    oriented : (n,) sequence of bool
        Whether a row has an orientation.
    joints : (n, k) array or None
        Commanded joints j1..jk, degrees, the maker's own zero and sign; NaN in a row that has none.
    measured_joints : (n, k) array or None
        Measured joints jm1..jmk, degrees.
    external_axes : (n, 6) array or None
        e1..e6 as the table has them (mm or degrees), NaN where empty or not connected.
    numbers : mapping of str to (n,) array
        Covariates that are numbers in every filled cell, NaN where empty, by the names of `columns`.
    unit : str
        Unit of length in the file: ``"mm"``, ``"inch"``, ``"m"``, ``"cm"``, ``"um"`` or ``"foot"``.
    issues : sequence of Issue
        What was converted, left out or understood in one of several ways.
    repeats : TableRepeats or None
        Every row, where spots stand in several rows that a column tells apart; all else is then of their means.
    """

    path: str
    ids: Sequence[str]
    xyz: Array | None
    rotations: Rotation | None
    lines: Sequence[int]
    columns: Mapping[str, Sequence[str]]
    sha256: str
    oriented: Sequence[bool] = ()
    joints: Array | None = None
    measured_joints: Array | None = None
    external_axes: Array | None = None
    numbers: Mapping[str, Array] = field(default_factory=dict)
    unit: str = "mm"
    issues: Sequence[Issue] = ()
    repeats: TableRepeats | None = None

    @property
    def positions(self) -> Array:
        """Positions, (n, 3), mm.

        Raises
        ------
        BadInputError
            ``MISSING_COLUMN`` if the table has none.
        """
        if self.xyz is None:
            what = "joints" if self.joints is not None else "IDs"
            raise BadInputError("MISSING_COLUMN", f"has {what} but no columns x, y, z; add the positions", self.path)
        return self.xyz
