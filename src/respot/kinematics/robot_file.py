"""A robot from a TOML file: ``--robot FILE`` (INTERFACES.md)."""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from respot.issues import BadInputError
from respot.kinematics.dh import DhRobot, Link
from respot.kinematics.model import RobotModel, checked_limits
from respot.kinematics.opw import LENGTHS, OpwRobot
from respot.kinematics.robots import find_robot

_COMMON = ("name", "convention", "limits_deg", "payload_kg", "source")
_KEYS = {
    "opw": (*_COMMON, *LENGTHS, "offsets_deg", "signs", "coupled_23"),
    "dh": (*_COMMON, "link"),
    "mdh": (*_COMMON, "link"),
}
_LINK = ("a", "alpha", "d", "offset", "type")


def robot_of(name_or_file: str) -> RobotModel:
    """Robot of ``--robot``: a TOML file if it ends in ``.toml`` or exists, else a name of the built-in list.

    Raises
    ------
    BadInputError
        There is no such robot, or the file is none.
    """
    path = Path(name_or_file)
    if path.suffix.lower() == ".toml" or path.is_file():
        return read_robot_file(path)
    return find_robot(name_or_file)


def read_robot_file(path: Path) -> RobotModel:
    """Read a robot from a TOML file.

    Raises
    ------
    BadInputError
        The file cannot be read, or does not describe a robot; the message names the key.
    """
    try:
        with path.open("rb") as stream:
            data = tomllib.load(stream)
    except OSError as error:
        raise BadInputError("CANNOT_READ", error.strerror or str(error), str(path)) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInputError("BAD_OPTION", f"no TOML file: {error}", str(path)) from error
    try:
        return _robot(data, path.stem, str(path))
    except (ValueError, TypeError) as error:
        raise BadInputError("BAD_OPTION", f"no robot: {error}", str(path)) from error


def robot_record(robot: RobotModel) -> dict[str, Any]:
    """What `robot_from_record` makes the same robot of: the keys of a robot's file; limits are left out."""
    if isinstance(robot, OpwRobot):
        lengths = {name: float(getattr(robot, name)) for name in LENGTHS}
        angles = {"offsets_deg": list(robot.offsets_deg), "signs": [int(sign) for sign in robot.signs]}
        return {"name": robot.name, "convention": "opw", **lengths, **angles, "coupled_23": robot.coupled_23}
    assert isinstance(robot, DhRobot)  # noqa: S101 - there are these two
    links = [
        {"a": link.a, "alpha": link.alpha, "d": link.d, "offset": link.offset}
        | ({"type": "prismatic"} if link.prismatic else {})
        for link in robot.links
    ]
    return {"name": robot.name, "convention": "mdh" if robot.modified else "dh", "link": links}


def robot_from_record(record: Mapping[str, Any]) -> RobotModel:
    """Robot of a record that `robot_record` made.

    Raises
    ------
    ValueError, TypeError
        The record describes no robot.
    """
    return _robot(record, "", "")


def _robot(data: Mapping[str, Any], name: str, source: str) -> RobotModel:
    convention = data.get("convention")
    if convention not in _KEYS:
        raise ValueError(f'convention must be "opw", "dh" or "mdh", not {convention!r}')
    _only(data, _KEYS[convention], "the file")
    common: dict[str, Any] = {"name": str(data.get("name", name)), "source": str(data.get("source", source))}
    if "payload_kg" in data:
        common["payload_kg"] = _number(data, "payload_kg", "the file")
    robot: RobotModel
    if convention == "opw":
        robot = _opw(data, common)
    else:
        links = data.get("link")
        if not isinstance(links, list) or not links:
            raise ValueError("a DH robot needs one [[link]] for each axis")
        made = tuple(_link(link, f"link {n}") for n, link in enumerate(links, start=1))
        robot = DhRobot(links=made, modified=convention == "mdh", **common)
    if "limits_deg" in data:
        robot = robot.with_limits(checked_limits(np.array(data["limits_deg"], dtype=float), robot.axes))
    return robot


def _opw(data: Mapping[str, Any], common: Mapping[str, Any]) -> OpwRobot:
    lengths: dict[str, Any] = {name: _number(data, name, "the file") for name in LENGTHS if name != "b" or name in data}
    angles: dict[str, Any] = {key: tuple(data[key]) for key in ("offsets_deg", "signs") if key in data}
    if not all(isinstance(value, int | float) for values in angles.values() for value in values):
        raise ValueError("offsets_deg and signs must be six numbers each")
    return OpwRobot(**common, **lengths, **angles, coupled_23=bool(data.get("coupled_23", False)))


def _link(data: Any, where: str) -> Link:
    if not isinstance(data, Mapping):
        raise ValueError(f"{where} is no table")
    _only(data, _LINK, where)
    kind = data.get("type", "revolute")
    if kind not in ("revolute", "prismatic"):
        raise ValueError(f'{where}: type must be "revolute" or "prismatic", not {kind!r}')
    a, alpha, d = (_number(data, key, where) for key in ("a", "alpha", "d"))
    offset = _number(data, "offset", where) if "offset" in data else 0.0
    return Link(a, alpha, d, offset, kind == "prismatic")


def _number(data: Mapping[str, Any], key: str, where: str) -> float:
    value = data.get(key)
    if value is None:
        raise ValueError(f"{where} lacks {key}")
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise ValueError(f"{where}: {key} = {value!r} is no number")
    return float(value)


def _only(data: Mapping[str, Any], known: Collection[str], where: str) -> None:
    for key in data:
        if key not in known:
            similar = get_close_matches(key, known, n=1)
            hint = f": did you mean {similar[0]}?" if similar else ""
            raise ValueError(f"{where} has an unknown key {key}{hint}")
