"""A calibration: the fitted model as a value that predicts, turns round, and is saved and loaded."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from respot.calibration.effects.catalogue import MECHANISMS
from respot.calibration.effects.moved import at_tip, missing, moved, unmoved
from respot.calibration.effects.term import Term
from respot.calibration.information import Information
from respot.calibration.observations import Observations
from respot.calibration.precision import Precision
from respot.kinematics.robot_file import robot_from_record
from respot.registration.rigid import homogeneous

Array = NDArray[np.float64]
Kind = Literal["theory", "measured"]
Frame = Literal["same", "free"]
Method = Literal["robust", "paper"]

SCHEMA = "respot.calibration/1"
SCHEMA_WITH_TOOL = "respot.calibration/2"
"""Of calibrations with a tool offset: a reader that knows version 1 only would leave it out, and must not read them."""
SCHEMA_WITH_EFFECTS = "respot.calibration/3"
"""Of calibrations with other effects."""

_ORTHOGONAL = 1e-9
#: What provenance says of the source, and the same of the reference.
_SIDES = (("source", "reference"), ("source_sha256", "reference_sha256"), ("robot", "reference_robot"))


class CalibrationError(ValueError):
    """A calibration that cannot be used.

    Attributes
    ----------
    code : str
        ``CALIBRATION_UNREADABLE``, ``CALIBRATION_SCHEMA``, ``CALIBRATION_INCOMPLETE``, ``CALIBRATION_CHANGED``,
        ``CALIBRATION_NOT_RIGID``, ``CALIBRATION_FRAMES``, ``CALIBRATION_NEEDS_ORIENTATION``, or ``CALIBRATION_EFFECTS``
        for what a calibration with effects needs or cannot do.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True, eq=False)
class Calibration:
    """The model ``reference = rotation @ effects(source + tool @ tool_offset) + translation`` and where it came from.

    ``tool`` is the tool's orientation in the source frame; without a tool offset it plays no part. Of effects there are
    any number; `respot.calibration.effects.moved` says how they move a spot.

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
    terms, values : tuples of equal length
        Effects beside, and the values of their parameters. A calibration with them needs to know more of a spot than
        its pose.
    robot : mapping or None
        Kinematics that the effects of the arm were fitted with, as `respot.kinematics.robot_file.robot_record`.
    precision : Precision or None
        How sure it is: not part of the content hash, and kept by a hash of its own in the file. None where nobody said.
    information : Information or None
        What its spots tell of effects and their rivals, for plans of further spots; kept as the precision is.

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
    terms: tuple[Term, ...] = ()
    values: tuple[Array, ...] = ()
    robot: Mapping[str, Any] | None = None
    information: Information | None = None

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
        sizes = [len(term.parameters) for term in self.terms]
        if [np.shape(value) for value in self.values] != [(size,) for size in sizes]:
            raise CalibrationError("CALIBRATION_INCOMPLETE", "an effect does not have one value for each parameter")
        if not all(np.isfinite(value).all() for value in self.values):
            raise CalibrationError("CALIBRATION_INCOMPLETE", "a value of an effect is no finite number")
        parameters = (6 if self.tool_offset is None else 9) + sum(sizes)
        if self.precision is not None and self.precision.parameters != parameters:
            message = f"the covariance must be {parameters} x {parameters}: the rigid part and what effects there are"
            raise CalibrationError("CALIBRATION_INCOMPLETE", message)
        for name, value in values.items():
            value += 0.0  # no negative zero: it would print, and hash, differently
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def source2reference(self) -> RigidTransform:
        """The rotation and translation as scipy object; a tool offset comes before it."""
        return RigidTransform.from_matrix(homogeneous(self.rotation, self.translation))

    def predict(
        self, points: ArrayLike, rotations: Rotation | None = None, observations: Observations | None = None
    ) -> tuple[Array, Rotation | None]:
        """Source poses in the reference frame.

        Parameters
        ----------
        points : (n, 3) array
            Source frame [mm].
        rotations : Rotation of n, optional
            Tool orientations in the source frame; turned with the points.
        observations : Observations of n, optional
            What else is known of the spots: needed for a calibration with effects. Its poses are not looked at.

        Returns
        -------
        points : (n, 3) array [mm]
        rotations : Rotation or None

        Raises
        ------
        CalibrationError
            ``CALIBRATION_NEEDS_ORIENTATION`` for a calibration with a tool offset and no orientations;
            ``CALIBRATION_EFFECTS`` for one with effects that the observations do not let be computed.
        """
        given = np.asarray(points, dtype=np.float64)
        if self.tool_offset is not None:
            if rotations is None:
                message = "the calibration has a tool offset: it moves a spot by its orientation, which is not known"
                raise CalibrationError("CALIBRATION_NEEDS_ORIENTATION", message)
            given = given + rotations.as_matrix() @ self.tool_offset
        if self.terms:
            given, rotations = moved(self._seen(given, rotations, observations), self.terms, self.values)
        there = given @ self.rotation.T + self.translation
        return there, None if rotations is None else Rotation.from_matrix(self.rotation) * rotations

    def effect_columns(self, observations: Observations) -> Array:
        """Shift (n, 3, k) of each spot per unit of each parameter of the effects, reference frame."""
        there = at_tip(observations, self.terms, self.values)
        shifts = [MECHANISMS[term.effect].shifts(there, term) for term in self.terms]
        return np.asarray(self.rotation @ np.concatenate(shifts, axis=2))

    def unpredict(self, points: ArrayLike, rotations: Rotation | None, observations: Observations | None) -> Array:
        """Source positions (n, 3) that are predicted to lie at ``points`` (n, 3) in the reference frame [mm].

        The spots keep their joints, orientations and columns. To 1e-9 mm.

        Parameters
        ----------
        points : (n, 3) array
            Reference frame [mm].
        rotations : Rotation of n, optional
            Tool orientations in the *source* frame.
        observations : Observations of n, optional
            As `predict`.

        Raises
        ------
        CalibrationError
            As `predict`.
        """
        wanted = (np.asarray(points, dtype=np.float64) - self.translation) @ self.rotation
        if self.terms:
            seen = self._seen(wanted, rotations, observations)
            try:
                wanted = unmoved(seen, self.terms, self.values, wanted)
            except ValueError as error:
                raise CalibrationError("CALIBRATION_EFFECTS", str(error)) from error
        if self.tool_offset is not None:
            if rotations is None:
                message = "the calibration has a tool offset: it moves a spot by its orientation, which is not known"
                raise CalibrationError("CALIBRATION_NEEDS_ORIENTATION", message)
            wanted = wanted - rotations.as_matrix() @ self.tool_offset
        return wanted

    def _seen(self, points: Array, rotations: Rotation | None, observations: Observations | None) -> Observations:
        if observations is None or len(observations) != len(points):
            names = ", ".join(term.label for term in self.terms)
            message = f"the calibration has effects ({names}): what they follow must be known of each spot"
            raise CalibrationError("CALIBRATION_EFFECTS", message)
        lacking = [term for term in self.terms if missing(observations, term)]
        if lacking:
            names = ", ".join(f"{term.label} needs {missing(observations, term)}" for term in lacking)
            raise CalibrationError("CALIBRATION_EFFECTS", names)
        return replace(observations, positions=points, rotations=rotations)

    def without(self, left_out: Collection[Term]) -> Calibration:
        """Return the calibration without some of its effects: what they did not tell of is as where they are zero."""
        keep = [place for place, term in enumerate(self.terms) if term not in left_out]
        first = 6 if self.tool_offset is None else 9
        stops = np.cumsum([0, *(len(value) for value in self.values)]) + first
        rows = [*range(first), *(row for place in keep for row in range(stops[place], stops[place + 1]))]
        sure = self.precision
        if sure is not None:
            squares = [sure.effect_scatter[place] for place in range(len(self.terms)) if place not in keep]
            unknown = np.sum(squares, axis=0) if squares else None
            scatter = tuple(sure.effect_scatter[place] for place in keep)
            cut = sure.covariance[np.ix_(rows, rows)]
            sure = replace(sure, covariance=cut, effect_scatter=scatter, unknown=unknown)
            if squares:  # the promise was made with them
                sure = replace(sure, heldout_rms=None, heldout_n=0)
        kept, values = tuple(self.terms[place] for place in keep), tuple(self.values[place] for place in keep)
        return replace(self, terms=kept, values=values, precision=sure)

    def _refuse_effects(self, what: str) -> None:
        if self.terms:
            message = f"a calibration with effects cannot be {what}: effects hold for spots of its own source"
            raise CalibrationError("CALIBRATION_EFFECTS", message)

    def inverse(self) -> Calibration:
        """Return the calibration from reference to source; kind, frame, ids and method stay, the provenance says so.

        The precision goes with it, but for a tool offset: where its fitted spots lie is known in the source frame only.

        Raises
        ------
        CalibrationError
            ``CALIBRATION_EFFECTS`` for a calibration with effects: `unpredict` finds single spots.
        """
        self._refuse_effects("turned round")
        rotation = self.rotation.T
        return replace(
            self,
            rotation=rotation,
            translation=-rotation @ self.translation,
            provenance={**_exchanged_sides(self.provenance), "inverse_of": self.content_hash},
            tool_offset=None if self.tool_offset is None else -self.tool_offset,
            precision=self.precision.inverted(self) if self.precision and self.tool_offset is None else None,
            information=None,
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
        self._refuse_effects("joined to another")
        other._refuse_effects("joined to another")
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
            **(self._effects() if self.terms else {}),
            "schema": self._schema,
            "kind": self.kind,
            "frame": self.frame,
            "ids": sorted(self.ids),
            "rotation": self.rotation.tolist(),
            "translation": self.translation.tolist(),
        }

    @property
    def _schema(self) -> str:
        if self.terms:
            return SCHEMA_WITH_EFFECTS
        return SCHEMA if self.tool_offset is None else SCHEMA_WITH_TOOL

    def _effects(self) -> dict[str, Any]:
        pairs = zip(self.terms, self.values, strict=True)
        return {
            "effects": [{**term.to_dict(), "values": value.tolist()} for term, value in pairs],
            "robot": None if self.robot is None else dict(self.robot),
        }

    def to_json(self) -> str:
        """JSON text of one of the three schemas; equal calibrations give equal text."""
        sure = None if self.precision is None else self.precision.to_dict()
        known = None if self.information is None else self.information.to_dict()
        record = {
            **self._content(),
            "method": self.method,
            "hash": self.content_hash,
            "ids": list(self.ids),
            "provenance": dict(self.provenance),
            **({} if sure is None else {"precision": sure, "precision_hash": _sha256(sure)}),
            **({} if known is None else {"information": known, "information_hash": _sha256(known)}),
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
            offset, sure, effects = record.get("tool_offset"), record.get("precision"), record.get("effects", [])
            known = record.get("information")
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
                terms=tuple(_term(each) for each in effects),
                values=tuple(np.array(each["values"], dtype=np.float64) for each in effects),
                robot=None if record.get("robot") is None else dict(record["robot"]),
                information=None if known is None else Information.from_dict(known),
            )
            schema, own = result._content()["schema"], result.content_hash
            if result.robot is not None:
                robot_from_record(result.robot)
            stated, kept = record["hash"], None if sure is None else record["precision_hash"]
            kept_beside = None if known is None else record["information_hash"]
        except KeyError as error:
            raise CalibrationError("CALIBRATION_INCOMPLETE", f"the calibration lacks the entry {error}") from error
        except CalibrationError:
            raise
        except (TypeError, ValueError) as error:
            raise CalibrationError(
                "CALIBRATION_INCOMPLETE", f"an entry of the calibration is wrong: {error}"
            ) from error
        if record["schema"] != schema:
            message = f"says schema {record['schema']!r}, but what it holds is {schema!r}: it was changed; fit it again"
            raise CalibrationError("CALIBRATION_SCHEMA", message)
        changed = stated != own or (result.precision and kept != _sha256(result.precision.to_dict()))
        if changed or (result.information and kept_beside != _sha256(result.information.to_dict())):
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


def _term(record: Mapping[str, Any]) -> Term:
    term = Term.from_dict(record)
    if term.effect not in MECHANISMS:
        raise ValueError(f"there is no effect {term.effect!r}")
    return term


def _parse(text: str) -> dict[str, Any]:
    try:
        record = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise CalibrationError("CALIBRATION_UNREADABLE", f"not JSON: {error}") from error
    if not isinstance(record, dict):
        raise CalibrationError("CALIBRATION_UNREADABLE", "not a calibration: the JSON is not an object")
    schema = record.get("schema")
    if schema not in (SCHEMA, SCHEMA_WITH_TOOL, SCHEMA_WITH_EFFECTS):
        found = re.fullmatch(r"respot\.calibration/([0-9]{1,9})", schema) if isinstance(schema, str) else None
        if found is None:
            advice = "not a calibration; save one with `respot fit ... -o CAL.json`"
        elif int(found[1]) > 3:
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
