"""Typed errors of the two numeric rooms; each carries the code of the issue that a user will see."""

from __future__ import annotations


class RegistrationError(ValueError):
    """Input from which no transform can be computed.

    Attributes
    ----------
    code : str
        Stable code: ``TOO_FEW_PAIRS``, ``TOO_MANY_SPOTS``, ``COLLINEAR_SPOTS``, ``COPLANAR_SPOTS``, ``NOT_A_NUMBER``,
        ``DUPLICATE_ID``, ``NO_COMMON_IDS``, ``SHAPE_MISMATCH``, ``BAD_OPTION``, ``NO_SUBSET``, ``NOT_CONGRUENT``,
        ``AMBIGUOUS_MATCH``, ``UNIT_MISMATCH`` or ``ROWS_SHIFTED``.
    ids : tuple of str
        The names concerned, where names are known.
    rows : tuple of int
        The rows concerned (0-based), where rows are known.
    """

    def __init__(self, code: str, message: str, *, ids: tuple[str, ...] = (), rows: tuple[int, ...] = ()) -> None:
        super().__init__(message)
        self.code = code
        self.ids = ids
        self.rows = rows


class DegenerateError(RegistrationError):
    """The points leave a part of the transform undetermined; the message says which part."""

    def __init__(self, message: str) -> None:
        super().__init__("COLLINEAR_SPOTS", message)
