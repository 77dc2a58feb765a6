"""A calibration: the fitted model as a value that predicts, turns round, and is saved and loaded."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from respot.calibration.precision import Precision
from respot.registration.rigid import homogeneous

Array = NDArray[np.float64]
Kind = Literal["theory", "measured"]
Frame = Literal["same", "free"]
Method = Literal["robust", "paper"]

SCHEMA = "respot.calibration/1"
SCHEMA_WITH_TOOL = "respot.calibration/2"
"""Of calibrations with a tool offset: a reader that knows version 1 only would leave it out, and must not read them."""

_ORTHOGONAL = 1e-9
#: What provenance says of the source, and the same of the reference.
_SIDES = (("source", "reference"), ("source_sha256", "reference_sha256"), ("robot", "reference_robot"))


class CalibrationError(ValueError):
    """A calibration that cannot be used.

    Attributes
    ----------
    code : str
        ``CALIBRATION_UNREADABLE``, ``CALIBRATION_SCHEMA``, ``CALIBRATION_INCOMPLETE``, ``CALIBRATION_CHANGED``,
        ``CALIBRATION_NOT_RIGID``, ``CALIBRATION_FRAMES`` or ``CALIBRATION_NEEDS_ORIENTATION``.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True, eq=False)
class Calibration:
    """The model ``reference = rotation @ (source + tool @ tool_offset) + translation`` and where it came from.

    ``tool`` is the tool's orientation in the source frame; without a tool offset it plays no part.

    Attributes
    ----------
    rotation : (3, 3) array
        Source to reference, proper and orthogonal to 1e-9.
    translation : (3,) array
        [mm]
    kind : "theory" or "measured"
        What the reference is: where spots should be, or where the robot went.
    frame : "same" or "free"
        Whether both coordinate systems claim to be the same (the transform is a deviation) or not (a registration).
    ids : tuple of str
        Names of the pairs it was fitted to, in order of the source.
    provenance : mapping
        Hashes, version, options: JSON values, not part of the content hash.
    method : "robust" or "paper"
        How it was fitted. An unconstrained (affine) solution is no calibration: it is no rigid motion.
    tool_offset : (3,) array or None
        By how much the TCP is wrong, in the tool frame [mm].
    precision : Precision or None
        How sure it is: not part of the content hash, and kept by a hash of its own in the file. None where nobody said.

    Raises
    ------
    CalibrationError
        ``CALIBRATION_NOT_RIGID`` for a matrix that is no rotation or numbers that are not finite;
        ``CALIBRATION_INCOMPLETE`` for an unknown kind, frame or method, or a precision of another model.
    """

    rotation: Array
    translation: Array
    kind: Kind
    frame: Frame
    ids: tuple[str, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    method: Method = "robust"
    tool_offset: Array | None = None
    precision: Precision | None = None

    def __post_init__(self) -> None:
        rotation, translation = np.array(self.rotation, dtype=np.float64), np.array(self.translation, dtype=np.float64)
        if rotation.shape != (3, 3) or translation.shape != (3,):
            raise CalibrationError("CALIBRATION_INCOMPLETE", "the rotation must be 3 x 3 and the translation 3 numbers")
        finite = np.isfinite(rotation).all() and np.isfinite(translation).all()
        if not finite or np.abs(rotation.T @ rotation - np.eye(3)).max() > _ORTHOGONAL or np.linalg.det(rotation) < 0:
            raise CalibrationError("CALIBRATION_NOT_RIGID", "the matrix is no rotation: this is no rigid calibration")
        if self.kind not in ("theory", "measured") or self.frame not in ("same", "free"):
            raise CalibrationError("CALIBRATION_INCOMPLETE", f"unknown kind or frame: {self.kind!r}, {self.frame!r}")
        if self.method not in ("robust", "paper"):
            raise CalibrationError("CALIBRATION_INCOMPLETE", f"unknown method: {self.method!r}")
        values = {"rotation": rotation, "translation": translation}
        if self.tool_offset is not None:
            values["tool_offset"] = np.array(self.tool_offset, dtype=np.float64)
            if values["tool_offset"].shape != (3,) or not np.isfinite(values["tool_offset"]).all():
                raise CalibrationError("CALIBRATION_INCOMPLETE", "the tool offset must be 3 finite numbers")
        if self.precision is not None and self.precision.parameters != (6 if self.tool_offset is None else 9):
            message = "the covariance must be 6 x 6, and 9 x 9 with a tool offset"
            raise CalibrationError("CALIBRATION_INCOMPLETE", message)
        for name, value in values.items():
            value += 0.0  # no negative zero: it would print, and hash, differently
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def source2reference(self) -> RigidTransform:
        """The rotation and translation as scipy object; a tool offset comes before it."""
        return RigidTransform.from_matrix(homogeneous(self.rotation, self.translation))

    def predict(self, points: ArrayLike, rotations: Rotation | None = None) -> tuple[Array, Rotation | None]:
        """Source poses in the reference frame.

        Parameters
        ----------
        points : (n, 3) array
            Source frame [mm].
        rotations : Rotation of n, optional
            Tool orientations in the source frame; turned with the points.

        Returns
        -------
        points : (n, 3) array [mm]
        rotations : Rotation or None

        Raises
        ------
        CalibrationError
            ``CALIBRATION_NEEDS_ORIENTATION`` for a calibration with a tool offset and no orientations.
        """
        given = np.asarray(points, dtype=np.float64)
        if self.tool_offset is not None:
            if rotations is None:
                message = "the calibration has a tool offset: it moves a spot by its orientation, which is not known"
                raise CalibrationError("CALIBRATION_NEEDS_ORIENTATION", message)
            given = given + rotations.as_matrix() @ self.tool_offset
        moved = given @ self.rotation.T + self.translation
        return moved, None if rotations is None else Rotation.from_matrix(self.rotation) * rotations

    def inverse(self) -> Calibration:
        """Return the calibration from reference to source; kind, frame, ids and method stay, the provenance says so.

        The precision goes with it, but for a tool offset: where its fitted spots lie is known in the source frame only.
        """
        rotation = self.rotation.T
        return replace(
            self,
            rotation=rotation,
            translation=-rotation @ self.translation,
            provenance={**_exchanged_sides(self.provenance), "inverse_of": self.content_hash},
            tool_offset=None if self.tool_offset is None else -self.tool_offset,
            precision=self.precision.inverted(self) if self.precision and self.tool_offset is None else None,
        )

    def compose(self, other: Calibration, *, same_middle: bool = False) -> Calibration:
        """Return the calibration that is this one followed by another: from this source to the other's reference.

        Parameters
        ----------
        other : Calibration
            Its source frame must be this one's reference frame. That is known where both were fitted to the same file.
        same_middle : bool
            You say that the two frames are the same, where files do not tell.

        Returns
        -------
        Calibration
            ``ids`` are this one's; ``frame`` is "same" if both are; intervals take the two fits as independent.

        Raises
        ------
        CalibrationError
            ``CALIBRATION_FRAMES`` if it is not known that the frames meet, or if one says where spots should be and the
            other where they went.
        """
        if self.kind != other.kind:
            message = (
                f"a {self.kind} and a {other.kind} calibration cannot be one: the first word decides what it means"
            )
            raise CalibrationError("CALIBRATION_FRAMES", message)
        mine, theirs = self.provenance.get("reference_sha256"), other.provenance.get("source_sha256")
        if not same_middle and (not isinstance(mine, str) or mine != theirs):
            first, second = self.provenance.get("reference", "unknown"), other.provenance.get("source", "unknown")
            message = (
                f"nothing proves that the reference of the first ({first}) and the source of the second ({second}) are "
                "in one frame; say same_middle=True if you know that they are"
            )
            raise CalibrationError("CALIBRATION_FRAMES", message)
        offsets = [part.tool_offset for part in (self, other) if part.tool_offset is not None]
        sure = None
        if self.precision and other.precision and not offsets:
            sure = self.precision.then(other.precision, self.inverse(), other)
        return Calibration(
            rotation=other.rotation @ self.rotation,
            translation=other.rotation @ self.translation + other.translation,
            kind=self.kind,
            frame="same" if self.frame == other.frame == "same" else "free",
            ids=self.ids,
            provenance=_chained(self, other),
            method="robust" if self.method == other.method == "robust" else "paper",
            tool_offset=np.sum(offsets, axis=0) if offsets else None,
            precision=sure,
        )

    @property
    def content_hash(self) -> str:
        """SHA-256 (hex) over the canonical JSON of what a correction depends on; floats by `repr`."""
        return _sha256(self._content())

    def _content(self) -> dict[str, Any]:
        # A method is said only where it is not the usual one: calibrations saved without the word keep their hash.
        return {
            **({} if self.method == "robust" else {"method": self.method}),
            **({} if self.tool_offset is None else {"tool_offset": self.tool_offset.tolist()}),
            "schema": SCHEMA if self.tool_offset is None else SCHEMA_WITH_TOOL,
            "kind": self.kind,
            "frame": self.frame,
            "ids": sorted(self.ids),
            "rotation": self.rotation.tolist(),
            "translation": self.translation.tolist(),
        }

    def to_json(self) -> str:
        """JSON text of schema `SCHEMA`, or `SCHEMA_WITH_TOOL`; equal calibrations give equal text."""
        sure = None if self.precision is None else self.precision.to_dict()
        record = {
            **self._content(),
            "method": self.method,
            "hash": self.content_hash,
            "ids": list(self.ids),
            "provenance": dict(self.provenance),
            **({} if sure is None else {"precision": sure, "precision_hash": _sha256(sure)}),
        }
        return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"

    @classmethod
    def from_json(cls, text: str) -> Calibration:
        """Read what `to_json` wrote.

        Raises
        ------
        CalibrationError
            ``CALIBRATION_UNREADABLE`` if it is no JSON object, ``CALIBRATION_SCHEMA`` if it is another schema,
            ``CALIBRATION_INCOMPLETE`` if an entry is missing or of the wrong type, ``CALIBRATION_CHANGED`` if its
            content does not have the hash it carries, ``CALIBRATION_NOT_RIGID`` if the matrix is no rotation.
        """
        record = _parse(text)
        try:
            offset, sure = record.get("tool_offset"), record.get("precision")
            result = cls(
                rotation=np.array(record["rotation"], dtype=np.float64),
                translation=np.array(record["translation"], dtype=np.float64),
                kind=record["kind"],
                frame=record["frame"],
                ids=tuple(str(name) for name in record["ids"]),
                provenance=dict(record["provenance"]),
                method=record.get("method", "robust"),
                tool_offset=None if offset is None else np.array(offset, dtype=np.float64),
                precision=None if sure is None else Precision.from_dict(sure),
            )
            stated, kept = record["hash"], None if sure is None else record["precision_hash"]
        except KeyError as error:
            raise CalibrationError("CALIBRATION_INCOMPLETE", f"the calibration lacks the entry {error}") from error
        except CalibrationError:
            raise
        except (TypeError, ValueError) as error:
            raise CalibrationError(
                "CALIBRATION_INCOMPLETE", f"an entry of the calibration is wrong: {error}"
            ) from error
        schema = result._content()["schema"]
        if record["schema"] != schema:
            message = f"says schema {record['schema']!r}, but what it holds is {schema!r}: it was changed; fit it again"
            raise CalibrationError("CALIBRATION_SCHEMA", message)
        if stated != result.content_hash or (result.precision and kept != _sha256(result.precision.to_dict())):
            raise CalibrationError(
                "CALIBRATION_CHANGED",
                "the calibration does not match the hash it carries: it was changed after it was saved; fit it again",
            )
        return result

    def save(self, path: Path) -> None:
        """Write `to_json` to a file (UTF-8, LF)."""
        path.write_text(self.to_json(), encoding="utf-8", newline="\n")

    @classmethod
    def load(cls, path: Path) -> Calibration:
        """Read a file that `save` wrote.

        Raises
        ------
        CalibrationError
            As `from_json`, and ``CALIBRATION_UNREADABLE`` if the file cannot be read.
        """
        try:
            text = path.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            raise CalibrationError("CALIBRATION_UNREADABLE", f"{path}: cannot be read: {error}") from error
        try:
            return cls.from_json(text)
        except CalibrationError as error:
            raise CalibrationError(error.code, f"{path}: {error}") from error


def _parse(text: str) -> dict[str, Any]:
    try:
        record = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise CalibrationError("CALIBRATION_UNREADABLE", f"not JSON: {error}") from error
    if not isinstance(record, dict):
        raise CalibrationError("CALIBRATION_UNREADABLE", "not a calibration: the JSON is not an object")
    schema = record.get("schema")
    if schema not in (SCHEMA, SCHEMA_WITH_TOOL):
        found = re.fullmatch(r"respot\.calibration/([0-9]{1,9})", schema) if isinstance(schema, str) else None
        if found is None:
            advice = "not a calibration; save one with `respot fit ... -o CAL.json`"
        elif int(found[1]) > 2:
            advice = "made by a newer respot: update this one, or fit it again"
        else:
            advice = "no version that respot ever wrote"
        raise CalibrationError("CALIBRATION_SCHEMA", f"schema {schema!r} is not {SCHEMA!r}: {advice}")
    return record


def _sha256(values: Mapping[str, Any]) -> str:
    text = json.dumps(values, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _exchanged_sides(provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Provenance with source and reference exchanged."""
    other = {name: partner for pair in _SIDES for name, partner in (pair, pair[::-1])}
    return {other.get(name, name): value for name, value in provenance.items()}


def _chained(first: Calibration, second: Calibration) -> dict[str, Any]:
    """Provenance from the first's source to the second's reference, and which calibrations are between them."""
    parts = [part.provenance.get("composed_of", [part.content_hash]) for part in (first, second)]
    sides = [
        {name: part.provenance[name] for pair in _SIDES if (name := pair[side]) in part.provenance}
        for side, part in enumerate((first, second))
    ]
    return {**sides[0], **sides[1], "composed_of": [*parts[0], *parts[1]]}
