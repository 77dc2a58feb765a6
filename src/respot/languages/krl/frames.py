"""Tools, bases and loads of ``$config.dat``, and the frames that expressions stand for.

Source: ``bas.src`` of KSS 5.4 to 8.6 (facts: krl.md section 5). ``BASE_DATA[n]`` is corrected by ``BASE_CORR`` and
``M_BASE_CORR`` while their switches are on, ``TOOL_DATA[n]`` by ``TOOL_CORR_W`` and ``TOOL_CORR``; it stands on a
moving kinematic if ``MACHINE_FRAME_DAT[n]`` names one.
"""

from __future__ import annotations

from functools import lru_cache

from scipy.spatial.transform import RigidTransform

from respot.geometry import pose, rotation_from_abc
from respot.languages.krl.run_time import RunTime
from respot.languages.krl.symbols import Aggregate, Symbol, Symbols
from respot.program.frames import Frame, Load, PoseLiteral

#: Switches of ``bas.src`` that correct all tools or all bases while the robot runs.
_CORRECTIONS = {"TOOL": ("TOOL_CORR_ON", "TOOL_CORR_W_ON"), "BASE": ("BASE_CORR_ON", "M_BAS_COR_ON")}
_MOST_NUMBERS = 1024


def frame_pose(aggregate: Aggregate) -> RigidTransform | None:
    """Pose of ``{X ..,Y ..,Z ..,A ..,B ..,C ..}``; None where one of the six is missing or no number."""
    values = [value for name in "XYZABC" if (value := aggregate.number(name)) is not None]
    if len(values) != 6:
        return None
    return pose(values[:3], rotation_from_abc(values[3:]))


def shift_of(aggregate: Aggregate) -> RigidTransform | None:
    """Shift of a relative motion, in which a component that is left out is zero; None where one is no number."""
    values = [aggregate.number(name) if name in aggregate.members else 0.0 for name in "XYZABC"]
    known = tuple(value for value in values if value is not None)
    return _shift(known) if len(known) == 6 else None


@lru_cache(maxsize=4096)
def _shift(components: tuple[float, ...]) -> RigidTransform:
    """Pose of X, Y, Z, A, B, C; programs go the same short ways again and again."""
    return pose(components[:3], rotation_from_abc(components[3:]))


class Frames:
    """The numbered tools, bases and loads of a robot; one object for each number.

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
        self._loads: dict[int, Load] = {}
        self._literal: dict[str, Frame] = {}

    def tool(self, number: int) -> Frame:
        """Tool of a number; 0 is the flange."""
        return self.numbered("TOOL", number)

    def base(self, number: int) -> Frame:
        """Base of a number; 0 is the world."""
        return self.numbered("BASE", number)

    def numbered(self, kind: str, number: int) -> Frame:
        """Frame of ``"TOOL"`` or ``"BASE"``."""
        key = (kind, max(number, 0))
        if key not in self._frames:
            self._frames[key] = self._read(*key)
        return self._frames[key]

    def declared(self, kind: str) -> list[Frame]:
        """Return all frames of ``"TOOL"`` or ``"BASE"`` that the robot's data hold."""
        array = self._symbols.config(f"{kind}_DATA")
        most = max((*array.size, 128), default=128) if array is not None else 128
        numbers = range(1, min(most, _MOST_NUMBERS) + 1)
        return [self.numbered(kind, number) for number in numbers if self._symbols.config(f"{kind}_DATA[{number}]")]

    def composed(self, name: str, found: RigidTransform, first: Frame) -> Frame:
        """Frame of a product; the same expression of the same value on the same frame is the same frame."""
        key = f"{id(first)}:{name.upper()}:{found.as_matrix().tobytes()!r}"
        return self._literal.setdefault(key, Frame(name, pose=found, stands_on=first))

    def literal(self, name: str, found: RigidTransform, path: str | None = None, line: int | None = None) -> Frame:
        """Frame of an expression; the same expression of the same value is the same frame."""
        key = f"{path}:{name.upper()}:{found.as_matrix().tobytes()!r}"
        return self._literal.setdefault(key, Frame(name, pose=found, path=path, line=line))

    def moving(self, name: str) -> Frame:
        """Base that stands on an external kinematic, a conveyor or another robot."""
        reason = "the base moves with an external kinematic"
        return self._literal.setdefault(name.upper(), Frame(name, pose=None, unknown=reason))

    def load(self, number: int) -> Load:
        """Load of a number: ``LOAD_DATA[n]``; a mass below 0 and number 0 mean the robot's default load."""
        if number not in self._loads:
            self._loads[number] = self._read_load(number)
        return self._loads[number]

    def typed(self, frame: Frame) -> tuple[str, str]:
        """Name of a frame and the mode it was measured for: ``#BASE``, ``#TCP``, or empty where nobody says."""
        symbol = self._symbols.config(frame.name.upper().replace("_DATA[", "_TYPE["))
        mode = "" if symbol is None else str(symbol.value).upper()
        return frame.name, mode if mode in ("#BASE", "#TCP") else ""

    def _read(self, kind: str, number: int) -> Frame:
        name = f"{kind}_DATA[{number}]"
        if number == 0:
            return Frame("$NULLFRAME" if kind == "TOOL" else "$WORLD", world=True)
        symbol = self._symbols.config(name)
        if symbol is None or not isinstance(symbol.value, Aggregate):
            return Frame(name, pose=None, unknown=self._missing(kind, number))
        if self._run_time.writes(symbol):
            return self._placed(symbol, None, "the program assigns to it")
        for switch in _CORRECTIONS[kind]:
            if self._is_on(switch):
                return self._placed(symbol, None, f"{switch} corrects it while the robot runs")
        if kind == "BASE" and self._moves(number):
            return self._placed(symbol, None, "the base moves with an external kinematic")
        found = frame_pose(symbol.value)
        return self._placed(symbol, found, "" if found is not None else "not all of X Y Z A B C are numbers")

    def _missing(self, kind: str, number: int) -> str:
        array = self._symbols.config(f"{kind}_DATA")
        if array is not None and array.others:
            return f"{kind}_DATA is declared globally in {array.path} and in {array.others[0].path}"
        if array is not None and array.size and number > array.size[0]:
            return f"{array.path}:{array.line} declares no more than {kind}_DATA[{array.size[0]}]"
        return f"{kind}_DATA[{number}] is not in the backup's $config.dat"

    def _placed(self, symbol: Symbol, found: RigidTransform | None, unknown: str) -> Frame:
        label = self._symbols.config(symbol.name.replace("_DATA[", "_NAME[").replace("]", ",]"))
        text = str(label.value).strip('" ') if label is not None and isinstance(label.value, str) else ""
        literal = None
        if found is not None and isinstance(symbol.value, Aggregate):
            members = symbol.value.numbers()
            numbers = {name: members[name] for name in "XYZABC"}
            literal = PoseLiteral(found, numbers, symbol.value.span, symbol.path, symbol.line)
        return Frame(symbol.name, text, found, unknown, symbol.path, symbol.line, literal=literal)

    def _is_on(self, name: str) -> bool:
        symbol = self._symbols.config(name)
        return self._run_time.switches_on(name) or (symbol is not None and str(symbol.value).upper() == "TRUE")

    def _moves(self, number: int) -> bool:
        """Whether a base stands on a kinematic other than the robot itself (FRAMES() of bas.src)."""
        place = self._symbols.config(f"MACHINE_FRAME_DAT[{number}]")
        index = (
            place.value.number("MACH_DEF_INDEX") if place is not None and isinstance(place.value, Aggregate) else None
        )
        if index is None or index <= 0:
            return False
        machine = self._symbols.config(f"MACHINE_DEF[{int(index)}]")
        if machine is None or not isinstance(machine.value, Aggregate):
            return True
        kind = str(machine.value.members.get("MECH_TYPE", "")).upper()
        return not (kind == "#NONE" or (kind == "#ROBOT" and machine.value.number("COOP_KRC_INDEX") == 1))

    def _read_load(self, number: int) -> Load:
        name = f"LOAD_DATA[{number}]"
        symbol = self._symbols.config(name) if number > 0 else None
        if number <= 0:
            return self._default_load("$DEF_L_M")
        if symbol is None or not isinstance(symbol.value, Aggregate):
            return Load(name, unknown=f"{name} is not in the backup's $config.dat")
        if self._run_time.writes(symbol):
            return Load(name, None, None, "the program assigns to it", symbol.path, symbol.line)
        mass = symbol.value.number("M")
        if mass is not None and mass < 0:
            return self._default_load(name)
        return literal_load(symbol.name, symbol.value, symbol.path, symbol.line)

    def _default_load(self, name: str) -> Load:
        mass, centre = self._symbols.config("$DEF_L_M"), self._symbols.config("$DEF_L_CM")
        if mass is None or centre is None or not isinstance(centre.value, Aggregate):
            return Load(name, unknown="it is the default load $DEF_L_M of the robot, which is not in the backup")
        members = {"M": mass.value or "", "CM": centre.value}
        return literal_load(name, Aggregate(members, "LOAD", centre.value.span), mass.path, mass.line)


def literal_load(name: str, value: Aggregate, path: str | None = None, line: int | None = None) -> Load:
    """Load of ``{M 12.5,CM {X ..},J {X ..}}``: kg and mm."""
    mass, place = value.number("M"), value.members.get("CM")
    if mass is None:
        return Load(name, None, None, "M is no number", path, line)
    values = [place.number(axis) for axis in "XYZ"] if isinstance(place, Aggregate) else []
    numbers = [number for number in values if number is not None]
    centre = (numbers[0], numbers[1], numbers[2]) if len(numbers) == 3 else None
    return Load(name, mass, centre, "", path, line)


def mode_conflict(tool: tuple[str, str], base: tuple[str, str], external: bool) -> str:
    """Say what is wrong where a tool or base (name and type) was measured for the other mode than a motion uses."""
    mode = "#TCP" if external else "#BASE"
    against = [f"{name} is of type {kind}" for name, kind in (tool, base) if kind and kind != mode]
    if not against:
        return ""
    return f"interpolates in {mode}, but {' and '.join(against)} in $config.dat: check which one is right"
