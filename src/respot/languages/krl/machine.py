"""Robot data of a KRC backup as plain values: ``$machine.dat``, frames of ``$config.dat``, ``am.ini``."""

from __future__ import annotations

import configparser

from scipy.spatial.transform import RigidTransform

from respot.geometry import pose, rotation_from_abc
from respot.languages.krl.run_time import RunTime
from respot.languages.krl.symbols import Aggregate, Scope, Symbol, Symbols, Value
from respot.program.frames import Frame
from respot.program.robot import Machine
from respot.program.targets import Number


def frame_pose(aggregate: Aggregate) -> RigidTransform | None:
    """Pose of ``{X ..,Y ..,Z ..,A ..,B ..,C ..}``; None where one of the six is missing or no number."""
    values = [value for name in "XYZABC" if (value := aggregate.number(name)) is not None]
    if len(values) != 6:
        return None
    return pose(values[:3], rotation_from_abc(values[3:]))


def read_machine(scope: Scope | None) -> Machine:
    """Values of ``$machine.dat``; the model is ``$TRAFONAME``."""
    if scope is None:
        return Machine()
    values = {key: _plain(symbol.value) for key, symbol in scope.symbols.items() if symbol.value is not None}
    model = str(values.get("$TRAFONAME[]", "")).strip().lstrip("#").strip()
    paths = tuple(dict.fromkeys(symbol.path for symbol in scope.symbols.values()))
    return Machine(model, values, paths)


def archive_name(am_ini: str) -> str:
    """Robot name of an archive's ``am.ini``, empty if it has none."""
    parser = configparser.ConfigParser(strict=False, interpolation=None, allow_no_value=True)
    try:
        parser.read_string(am_ini)
    except configparser.Error:
        return ""
    return parser.get("Roboter", "RobName", fallback="").strip()


class Frames:
    """The numbered tools and bases of a robot; one `Frame` object for each number.

    Parameters
    ----------
    symbols : Symbols
        Data of the robot.
    run_time : RunTime
        What its code changes.
    """

    def __init__(self, symbols: Symbols, run_time: RunTime) -> None:
        self._symbols = symbols
        self._run_time = run_time
        self._frames: dict[tuple[str, int], Frame] = {}

    def tool(self, number: int) -> Frame:
        """Tool of a number; 0 is the flange."""
        return self._frame("TOOL", number)

    def base(self, number: int) -> Frame:
        """Base of a number; 0 is the world."""
        return self._frame("BASE", number)

    def declared(self, kind: str) -> list[Frame]:
        """Return all frames of ``"TOOL"`` or ``"BASE"`` that the robot's data hold."""
        numbers = (number for number in range(1, 129) if self._symbols.config(f"{kind}_DATA[{number}]"))
        return [self._frame(kind, number) for number in numbers]

    def _frame(self, kind: str, number: int) -> Frame:
        key = (kind, number)
        if key not in self._frames:
            self._frames[key] = self._read(kind, number)
        return self._frames[key]

    def _read(self, kind: str, number: int) -> Frame:
        name = f"{kind}_DATA[{number}]"
        if number == 0:
            return Frame("$NULLFRAME" if kind == "TOOL" else "$WORLD", world=True)
        symbol = self._symbols.config(name)
        if symbol is None or not isinstance(symbol.value, Aggregate):
            return Frame(name, pose=None, unknown=f"{name} is not in the backup's $config.dat")
        if self._run_time.writes_element(name):
            return self._placed(symbol, None, "the program assigns to it")
        if self._is_true(f"{kind}_CORR_ON"):
            return self._placed(symbol, None, f"{kind}_CORR_ON corrects it while the robot runs")
        if kind == "BASE" and self._moves(number):
            return self._placed(symbol, None, "the base moves with an external axis")
        found = frame_pose(symbol.value)
        return self._placed(symbol, found, "" if found is not None else "not all of X Y Z A B C are numbers")

    def _placed(self, symbol: Symbol, found: RigidTransform | None, unknown: str) -> Frame:
        label = self._symbols.config(symbol.name.replace("_DATA[", "_NAME[").replace("]", ",]"))
        text = str(label.value).strip('" ') if label is not None and isinstance(label.value, str) else ""
        return Frame(symbol.name, text, found, unknown, symbol.path, symbol.line)

    def _is_true(self, name: str) -> bool:
        symbol = self._symbols.config(name)
        return self._run_time.writes(name) or (symbol is not None and str(symbol.value).upper() == "TRUE")

    def _moves(self, number: int) -> bool:
        symbol = self._symbols.config(f"MACHINE_FRAME_DAT[{number}]")
        if symbol is None or not isinstance(symbol.value, Aggregate):
            return False
        return (symbol.value.number("MACH_DEF_INDEX") or 0) > 0


def _plain(value: Value | None) -> object:
    if isinstance(value, Number):
        return float(value.value)
    if isinstance(value, Aggregate):
        return {name: _plain(member) for name, member in value.members.items()}
    return "" if value is None else value.strip('"')
