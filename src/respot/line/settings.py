"""The options of a robot in a line file: the long options of fit and convert, as the dataclasses behind them have them.

A field of `FitOptions` or `CorrectionOptions` is a key, and its type says what may stand there: an option that these
learn is one that a line file knows. What is read stays plain values, so that it can be hashed, stored and sent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from respot.calibration.causes import names_of
from respot.calibration.effects.search import RIGID_ONLY, Effects
from respot.calibration.source_fit import FitOptions
from respot.correction.options import CorrectionOptions
from respot.kinematics.model import RobotModel
from respot.kinematics.robot_file import robot_of
from respot.registration.errors import RegistrationError

Plain = bool | int | float | str | list[Any]
Reader = Callable[[Any], Plain]

#: Of a spot, mm: what a page marks.
TOLERANCE = 10.0
#: Fields that are no options: what a line file says otherwise, and what no person decides.
_NO_OPTIONS = {"kind", "progress", "any_source"}
#: Fields whose option has another name.
_NAMES = {"profiles": "profile"}
#: What a calibration that is fitted already takes of the options of a fit.
_WITH_CALIBRATION = {"robot_name", "spot_id", "profile"}


class OptionError(ValueError):
    """A value that an option cannot have; ``key`` says which."""

    def __init__(self, key: str, message: str) -> None:
        self.key = key
        super().__init__(message)


def read_option(key: str, value: Any) -> Plain:
    """Read the value of a key.

    Raises
    ------
    OptionError
        The value is of another type, or none that the option has.
    """
    try:
        return _READERS[key](value)
    except ValueError as error:
        raise OptionError(key, f"{key} must be {error}, not {value!r}") from error


def fit_options(kind: Literal["theory", "measured"], options: Mapping[str, Plain]) -> FitOptions:
    """Options of the fit of a robot; paths are relative to the working folder.

    Raises
    ------
    BadInputError
        There is no such robot as ``robot`` names.
    """
    chosen = _values(FitOptions, options)
    chosen["effects"] = _effects(options.get("effects"), kind)
    if kind == "theory":
        chosen.pop("robot", None)
    return FitOptions(kind=kind, **chosen)


def correction_options(options: Mapping[str, Plain]) -> CorrectionOptions:
    """Options of the correction of a robot's programs.

    Raises
    ------
    BadInputError
        There is no such robot as ``robot`` names.
    """
    return CorrectionOptions(**_values(CorrectionOptions, options))


def tolerance_of(options: Mapping[str, Plain]) -> float:
    """Tolerance of a spot [mm]."""
    value = options.get("tolerance", TOLERANCE)
    assert isinstance(value, float)  # noqa: S101 - it was read as one
    return value


def check_options(options: Mapping[str, Plain]) -> None:
    """Refuse options that make no sense together, before a line starts.

    Raises
    ------
    OptionError
        With the key to change.
    """
    if options.get("method") == "affine":
        message = "method affine is no rigid motion, and no program may be corrected by it: use robust"
        raise OptionError("method", message)
    for key in ("tau", "n_min"):
        if key in options and options.get("method") != "paper":
            raise OptionError(key, f'{key} belongs to the paper\'s method: add method = "paper"')
    check_correction(options)


def check_correction(options: Mapping[str, Plain]) -> None:
    """Refuse options of a correction that make no sense together.

    Raises
    ------
    OptionError
        With the key to change.
    """
    if options.get("apply") == "frames" and options.get("partial"):
        message = "partial leaves targets behind, and a base or tool that changes takes all of them along"
        raise OptionError("partial", f'apply = "frames": {message}')


def check_with_calibration(own: Mapping[str, Plain]) -> None:
    """Refuse options of a fit for a robot whose calibration is fitted already.

    Raises
    ------
    OptionError
        With the key to leave out.
    """
    for key in own:
        if key in _KEYS[FitOptions] and key not in _KEYS[CorrectionOptions] and key not in _WITH_CALIBRATION:
            raise OptionError(key, f"{key} belongs to a fit; the calibration of this robot is fitted already")


def _values(of: type[FitOptions] | type[CorrectionOptions], options: Mapping[str, Plain]) -> dict[str, Any]:
    hints = get_type_hints(of)
    return {field: _typed(hints[field], options[key]) for key, field in _KEYS[of].items() if key in options}


def _typed(hint: Any, value: Plain) -> Any:
    """Turn a plain value into what the field holds."""
    kinds = _kinds(hint)
    if RobotModel in kinds:
        return robot_of(str(value))
    if hint == Sequence[Path]:
        assert isinstance(value, list)  # noqa: S101 - it was read as one
        return tuple(Path(item) for item in value)
    if Path in kinds and isinstance(value, str):
        return Path(value)
    if _is_shift(hint):
        assert isinstance(value, list)  # noqa: S101 - it was read as one
        return tuple(value)
    return value


def _effects(value: Plain | None, kind: str) -> Effects:
    if value is None:
        return "auto" if kind == "measured" else RIGID_ONLY
    return "auto" if value == "auto" else tuple(value) if isinstance(value, list) else ()


def _kinds(hint: Any) -> tuple[Any, ...]:
    """Types that a field may hold, without None."""
    if get_origin(hint) in (Union, UnionType):
        return tuple(kind for kind in get_args(hint) if kind is not NoneType)
    return (hint,)


def _is_shift(hint: Any) -> bool:
    return any(get_origin(kind) is tuple for kind in _kinds(hint))


def _reader(name: str, hint: Any) -> Reader:
    """What reads a field of a type."""
    kinds = _kinds(hint)
    if name == "effects":
        return _read_effects
    if hint == Sequence[Path]:
        return _read_texts
    if _is_shift(hint):
        return _read_shift
    if kinds == (bool,):
        return _read_bool
    if kinds == (int,):
        return _read_count
    if kinds == (float,):
        return _read_number
    if set(kinds) == {float, Path}:
        return lambda value: _read_text(value) if isinstance(value, str) else _read_number(value)
    words = [word for kind in kinds if get_origin(kind) is Literal for word in get_args(kind)]
    if words:
        return lambda value: _read_word(value, words)
    return _read_text


def _read_bool(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError("true or false")
    return value


def _read_count(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError("a whole number, not negative")
    return value


def _read_number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < math.inf:
        raise ValueError("a number, not negative")
    return float(value)


def _read_text(value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError("a text in quotes")
    return value


def _read_texts(value: Any) -> list[str]:
    items = value if isinstance(value, list) else [value]
    if not items or not all(isinstance(item, str) and item for item in items):
        raise ValueError("a text in quotes, or a list of them")
    return items


def _read_word(value: Any, words: Sequence[str]) -> str:
    if value not in words:
        raise ValueError(" or ".join(f'"{word}"' for word in words))
    return str(value)


def _read_shift(value: Any) -> list[Any]:
    items = value.split(",") if isinstance(value, str) else value if isinstance(value, list) else [value]
    try:
        numbers = [_read_number(float(item) if isinstance(item, str) else item) for item in items]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        raise ValueError('"MM" or "MM,DEG"')
    return [*numbers, None][:2]  # a turn that is not said is that of the kind


def _read_effects(value: Any) -> Plain:
    if value == "auto":
        return "auto"
    items = [] if value == "none" else value.split(",") if isinstance(value, str) else value
    if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
        raise ValueError('"auto", "none" or names with commas')
    names = list(dict.fromkeys(item.strip() for item in items))
    try:
        return list(names_of(names))
    except RegistrationError as error:
        raise ValueError(f'"auto", "none" or names with commas ({error})') from error


def _keys(of: type[FitOptions] | type[CorrectionOptions]) -> dict[str, str]:
    return {_NAMES.get(field.name, field.name): field.name for field in fields(of) if field.name not in _NO_OPTIONS}


_KEYS = {of: _keys(of) for of in (FitOptions, CorrectionOptions)}
_READERS: dict[str, Reader] = {
    "tolerance": _read_number,
    **{
        key: _reader(field, get_type_hints(of)[field])
        for of in (FitOptions, CorrectionOptions)
        for key, field in _KEYS[of].items()
    },
}
#: Every key that is an option.
OPTIONS: tuple[str, ...] = tuple(sorted(_READERS))
#: Options that name files or folders, which a robot's result depends on.
FILES: tuple[str, ...] = tuple(
    sorted(
        {
            key
            for of in (FitOptions, CorrectionOptions)
            for key, field in _KEYS[of].items()
            if {Path, RobotModel, Sequence[Path]} & set(_kinds(get_type_hints(of)[field]))
        }
    )
)
