"""The line file: which robots, which reference each, which options (INTERFACES, LINE.toml).

What is wrong with it is said with its line, before any robot is touched; a backup or reference that is not there is
that robot's own failure, and the others go on.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from os.path import normpath
from pathlib import Path
from typing import Any, Literal

from respot.issues import BadInputError
from respot.kinematics.robot_file import robot_of
from respot.line.places import Places
from respot.line.settings import (
    OPTIONS,
    OptionError,
    Plain,
    check_correction,
    check_options,
    check_with_calibration,
    read_option,
)

_CODE = "BAD_LINE_FILE"
_LINE = ("name", "theory", "measured")
_TEXTS = ("source", "theory", "measured", "calibration", "group", "station", "gun", "generation")
#: What a person may say about a robot for the view over the line, beside what its backup tells.
TRAITS = ("station", "gun", "generation")
_ROBOT = ("name", *_TEXTS)
#: What no file system takes for a name, or takes for another one.
_NO_NAME = re.compile(r'[/\\:*?"<>|\x00-\x1f]|^[. ]|[. ]$|^(con|prn|aux|nul|com\d|lpt\d)(\.|$)', re.IGNORECASE)
_LONGEST_NAME = 100

Kind = Literal["theory", "measured"]


@dataclass(frozen=True)
class LineRobot:
    """One robot of a line; paths as written, relative to the line file.

    Parameters
    ----------
    name : str
        Its name, and that of its folder.
    source : str
        Its backup.
    kind : str or None
        What the reference is; None where a calibration stands in its place.
    reference : str or None
        Table or backup to fit to.
    calibration : str or None
        A saved calibration, in place of a fit.
    group : str
        Robots that share a fixture or rail; empty for none.
    traits : mapping of str to str
        Station, gun, generation, as far as they are said.
    options : mapping of str to plain value
        Options of fit and convert, those of ``[defaults]`` included.
    """

    name: str
    source: str
    kind: Kind | None
    reference: str | None
    calibration: str | None
    group: str
    traits: Mapping[str, str]
    options: Mapping[str, Plain]


@dataclass(frozen=True)
class LineFile:
    """A line.

    Parameters
    ----------
    path : Path
        The file.
    name : str
        Of the line.
    robots : sequence of LineRobot
        In the order of the file.
    """

    path: Path
    name: str
    robots: Sequence[LineRobot]

    @property
    def folder(self) -> Path:
        """What paths are relative to."""
        return self.path.absolute().parent


def read_line(path: Path) -> LineFile:
    """Read a line file.

    Raises
    ------
    BadInputError
        ``CANNOT_READ``, ``BAD_LINE_FILE``, ``UNKNOWN_KEY`` or ``SAME_ROBOT_TWICE``, with the line.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise BadInputError("CANNOT_READ", error.strerror or str(error), str(path)) from error
    except UnicodeDecodeError as error:
        raise BadInputError(_CODE, f"is not UTF-8: {error}", str(path)) from error
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"at line (\d+)", str(error))
        raise BadInputError(_CODE, f"is no TOML: {error}", str(path), int(place[1]) if place else None) from error
    return _Reader(path, Places(text)).line(data)


class _Reader:
    """Reads the tables of one file, and knows where it is."""

    def __init__(self, path: Path, places: Places) -> None:
        self._path = path
        self._places = places

    def line(self, data: Mapping[str, Any]) -> LineFile:
        """Read the whole file."""
        self._known(data, ("line", "defaults", "robot"), "", 0, "the file")
        head, defaults = self._table(data, "line"), self._table(data, "defaults")
        self._known(head, _LINE, "line", 0, "[line]")
        self._known(defaults, OPTIONS, "defaults", 0, "[defaults]")
        name = self._text(head, "name", "line", 0)
        if name is None:
            raise self._bad("[line] has no name: the output folder belongs to the line of this name", "line", 0)
        reference = self._reference(head, "line", 0)
        common = self._options(defaults, "defaults", 0)
        robots = data.get("robot", [])
        if not isinstance(robots, list) or not robots or not all(isinstance(item, dict) for item in robots):
            raise self._bad("has no robot: each stands under [[robot]]", "robot", 0)
        read = [self._robot(_plain_keys(item), number, reference, common) for number, item in enumerate(robots)]
        self._no_twins(read)
        return LineFile(self._path, name, read)

    def _robot(
        self, data: Mapping[str, Any], number: int, shared: tuple[Kind | None, str | None], common: Mapping[str, Plain]
    ) -> LineRobot:
        name = self._text(data, "name", "robot", number)
        if name is None:
            raise self._bad(f"robot {number + 1} has no name", "robot", number)
        if _NO_NAME.search(name) or len(name) > _LONGEST_NAME:
            raise self._bad(
                f"{name!r} cannot be the name of a folder, and each robot gets one", "robot", number, "name"
            )
        self._known(data, (*_ROBOT, *OPTIONS), "robot", number, f"robot {name}")
        texts = {key: self._text(data, key, "robot", number) for key in _TEXTS}
        if texts["source"] is None:
            raise self._bad(f"robot {name} has no source: name its backup", "robot", number)
        own = self._options({key: data[key] for key in data if key in OPTIONS}, "robot", number)
        options = {**common, **own}
        kind, reference = self._reference(data, "robot", number)
        if texts["calibration"] is not None and kind is not None:
            message = f"robot {name} has a calibration and a reference to fit to: leave one out"
            raise self._bad(message, "robot", number, "calibration")
        if texts["calibration"] is None:
            kind, reference = (kind, reference) if kind is not None else shared
            if kind is None:
                message = f"robot {name} has no reference: theory, measured or calibration, here or under [line]"
                raise self._bad(message, "robot", number)
        self._check(name, number, kind, options, own)
        return LineRobot(
            name=name,
            source=texts["source"],
            kind=kind,
            reference=reference,
            calibration=texts["calibration"],
            group=texts["group"] or "",
            traits={key: value for key in TRAITS if (value := texts[key]) is not None},
            options=options,
        )

    def _check(
        self, name: str, number: int, kind: Kind | None, options: Mapping[str, Plain], own: Mapping[str, Plain]
    ) -> None:
        try:
            if kind is None:
                check_with_calibration(own)
                check_correction(options)
            else:
                check_options(options)
        except OptionError as error:
            section, place = ("robot", number) if error.key in own else ("defaults", 0)
            raise self._bad(f"robot {name}: {error}", section, place, error.key) from error

    def _options(self, data: Mapping[str, Any], section: str, number: int) -> dict[str, Plain]:
        read = {}
        for key, value in data.items():
            try:
                read[key] = read_option(key, value)
            except OptionError as error:
                raise self._bad(str(error), section, number, key) from error
        if "robot" in read:
            self._arm(str(read["robot"]), section, number)
        return read

    def _arm(self, robot: str, section: str, number: int) -> None:
        """Refuse a kinematic model that does not exist."""
        try:
            file = self._path.absolute().parent / robot
            robot_of(str(file) if file.is_file() or robot.lower().endswith(".toml") else robot)
        except BadInputError as error:
            raise self._bad(f"robot = {robot!r}: {error.issue.message}", section, number, "robot") from error

    def _reference(self, data: Mapping[str, Any], section: str, number: int) -> tuple[Kind | None, str | None]:
        theory, measured = (self._text(data, key, section, number) for key in ("theory", "measured"))
        if theory is not None and measured is not None:
            message = "theory and measured: the reference is one of both, and what it is decides what is written"
            raise self._bad(message, section, number, "measured")
        if theory is not None:
            return "theory", theory
        return (None, None) if measured is None else ("measured", measured)

    def _no_twins(self, robots: Sequence[LineRobot]) -> None:
        """Refuse one robot under two entries: by its name, or by its backup."""
        names: dict[str, str] = {}
        sources: dict[tuple[str, object], str] = {}
        for number, robot in enumerate(robots):
            if robot.name.casefold() in names:
                raise self._twice(f"robot {robot.name} stands twice: give each its own name", number, "name")
            source = normpath(self._path.absolute().parent / robot.source)
            backup = (source, str(robot.options.get("robot_name", "")).casefold())
            if backup in sources:
                message = (
                    f"robot {robot.name} has the backup of robot {sources[backup]}: leave one out, or say with "
                    "robot_name which robot of the backup each is"
                )
                raise self._twice(message, number, "source")
            names[robot.name.casefold()] = sources[backup] = robot.name

    def _twice(self, message: str, number: int, key: str) -> BadInputError:
        return BadInputError("SAME_ROBOT_TWICE", message, str(self._path), self._places.line("robot", number, key))

    def _table(self, data: Mapping[str, Any], name: str) -> dict[str, Any]:
        table = data.get(name, {})
        if not isinstance(table, dict):
            raise self._bad(f"{name} must be a table: [{name}]", "", 0, name)
        return _plain_keys(table)

    def _text(self, data: Mapping[str, Any], key: str, section: str, number: int) -> str | None:
        value = data.get(key)
        if value is not None and (not isinstance(value, str) or not value.strip()):
            raise self._bad(f"{key} must be a text in quotes, not {value!r}", section, number, key)
        return value

    def _known(self, data: Mapping[str, Any], known: Sequence[str], section: str, number: int, where: str) -> None:
        for key in data:
            if key in known:
                continue
            close = get_close_matches(key, known, n=1)
            hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(known)}"
            line = self._places.line(section, number, key) or self._places.line(key)
            raise BadInputError("UNKNOWN_KEY", f"{where} has a key {key!r}: {hint}", str(self._path), line)

    def _bad(self, message: str, section: str, number: int, key: str | None = None) -> BadInputError:
        return BadInputError(_CODE, message, str(self._path), self._places.line(section, number, key))


def _plain_keys(table: Mapping[str, Any]) -> dict[str, Any]:
    """Spell keys as we do: an option's long name may be written as on the command line, with a hyphen."""
    return {key.replace("-", "_"): value for key, value in table.items()}
