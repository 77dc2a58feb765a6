"""A calibration: the fitted model as a value that predicts, turns round, and is saved and loaded."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from respot.registration.rigid import homogeneous

Array = NDArray[np.float64]
Kind = Literal["theory", "measured"]
Frame = Literal["same", "free"]
Method = Literal["robust", "paper"]

SCHEMA = "respot.calibration/1"
_ORTHOGONAL = 1e-9


class CalibrationError(ValueError):
    """A calibration that cannot be used.

    Attributes
    ----------
    code : str
        ``CALIBRATION_UNREADABLE``, ``CALIBRATION_SCHEMA``, ``CALIBRATION_INCOMPLETE``, ``CALIBRATION_CHANGED`` or
        ``CALIBRATION_NOT_RIGID``.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True, eq=False)
class Calibration:
    """The model ``reference = rotation @ source + translation`` and where it came from.

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

    Raises
    ------
    CalibrationError
        ``CALIBRATION_NOT_RIGID`` for a matrix that is no rotation or numbers that are not finite;
        ``CALIBRATION_INCOMPLETE`` for an unknown kind, frame or method.
    """

    rotation: Array
    translation: Array
    kind: Kind
    frame: Frame
    ids: tuple[str, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    method: Method = "robust"

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
        for name, value in (("rotation", rotation), ("translation", translation)):
            value += 0.0  # no negative zero: it would print, and hash, differently
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def source2reference(self) -> RigidTransform:
        """The transform as scipy object."""
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
        """
        moved = np.asarray(points, dtype=np.float64) @ self.rotation.T + self.translation
        return moved, None if rotations is None else Rotation.from_matrix(self.rotation) * rotations

    def inverse(self) -> Calibration:
        """Return the calibration from reference to source; kind, frame, ids and method stay, the provenance says so."""
        rotation = self.rotation.T
        return Calibration(
            rotation=rotation,
            translation=-rotation @ self.translation,
            kind=self.kind,
            frame=self.frame,
            ids=self.ids,
            provenance={**self.provenance, "inverse_of": self.content_hash},
            method=self.method,
        )

    @property
    def content_hash(self) -> str:
        """SHA-256 (hex) over the canonical JSON of what a correction depends on; floats by `repr`."""
        text = json.dumps(self._content(), sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode("ascii")).hexdigest()

    def _content(self) -> dict[str, Any]:
        # A method is said only where it is not the usual one: calibrations saved without the word keep their hash.
        return {
            **({} if self.method == "robust" else {"method": self.method}),
            "schema": SCHEMA,
            "kind": self.kind,
            "frame": self.frame,
            "ids": sorted(self.ids),
            "rotation": self.rotation.tolist(),
            "translation": self.translation.tolist(),
        }

    def to_json(self) -> str:
        """JSON text of schema `SCHEMA`; equal calibrations give equal text."""
        record = {
            **self._content(),
            "method": self.method,
            "hash": self.content_hash,
            "ids": list(self.ids),
            "provenance": dict(self.provenance),
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
            result = cls(
                rotation=np.array(record["rotation"], dtype=np.float64),
                translation=np.array(record["translation"], dtype=np.float64),
                kind=record["kind"],
                frame=record["frame"],
                ids=tuple(str(name) for name in record["ids"]),
                provenance=dict(record["provenance"]),
                method=record.get("method", "robust"),
            )
            stated = record["hash"]
        except KeyError as error:
            raise CalibrationError("CALIBRATION_INCOMPLETE", f"the calibration lacks the entry {error}") from error
        except CalibrationError:
            raise
        except (TypeError, ValueError) as error:
            raise CalibrationError(
                "CALIBRATION_INCOMPLETE", f"an entry of the calibration is wrong: {error}"
            ) from error
        if stated != result.content_hash:
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
    if schema != SCHEMA:
        raise CalibrationError(
            "CALIBRATION_SCHEMA", f"schema {schema!r} is not {SCHEMA!r}: not a calibration of this version"
        )
    return record
