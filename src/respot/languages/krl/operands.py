"""What the operand of a KRL motion stands for: a declared point, an element, a member, a literal, a product."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY
from respot.languages.forms import Forms
from respot.languages.krl.frames import frame_pose
from respot.languages.krl.run_time import Passed, RunTime
from respot.languages.krl.symbols import Aggregate, Symbol, Symbols, bare_name, value_of
from respot.languages.krl.targets import POSITION_TYPES, Targets
from respot.languages.literals import number_of
from respot.program.moves import Doubt
from respot.program.statement import Node
from respot.program.targets import Target, TargetKind

_INDEX = re.compile(r"\[([^\]]*)\]")
_WHOLE = re.compile(r"\d+(?:,\d+)*")
_MOST_CALLS = 4
_POINTS = frozenset(("POS", "E6POS", "E3POS"))
_ORIGIN = "$NULLFRAME"
#: System data that follow the robot: where it is, was interrupted, left its path, or has its home.
_FOLLOWING = re.compile(r"\$(?:(?:POS|AXIS)_(?:ACT|INT|RET|BACK|FOR)(?:_\w+)?|H_POS)(?![\w$])", re.IGNORECASE)


@dataclass(frozen=True)
class Place:
    """Where an operand stands.

    Parameters
    ----------
    module, path : str
        Key of the module, and the file.
    name : str
        Name for a literal in the code.
    local : mapping of str to str
        Names, in upper case, that the routine declares itself, with their types.
    parameters : sequence of str
        Those of them that its callers pass, in order.
    passed : sequence of Passed
        What the callers pass.
    """

    module: str
    path: str
    name: str = ""
    local: Mapping[str, str] = field(default_factory=dict)
    parameters: Sequence[str] = ()
    passed: Sequence[Passed] = ()

    def at(self, name: str) -> Place:
        """Return the place with a name for a literal."""
        return Place(self.module, self.path, name, self.local, self.parameters, self.passed)


@dataclass(frozen=True)
class Operand:
    """Target of an operand with its shift in its own axes, and what is not known of it."""

    target: Target | None = None
    doubt: Doubt | None = None
    tool_offset: RigidTransform | None = IDENTITY


class Operands:
    """Reads operands of motions and data of statements.

    Parameters
    ----------
    symbols : Symbols
        Data of the robot.
    targets : Targets
        Its literal positions.
    run_time : RunTime
        What its code changes.
    forms : Forms
        Instruction forms.
    """

    def __init__(self, symbols: Symbols, targets: Targets, run_time: RunTime, forms: Forms) -> None:
        self._symbols = symbols
        self._targets = targets
        self._run_time = run_time
        self._forms = forms

    def read(self, node: Node, place: Place) -> Operand:
        """Read the operand of a motion."""
        if node.kind == "reference" and _FOLLOWING.match(node.text):
            return Operand()
        operands = list(_operands(node))
        if len(operands) > 1 and operands[0].text.startswith("$"):
            return _unknown(f"{node.text} starts from {operands[0].text.strip()}, which is no position in a file")
        if len(operands) > 1 and self._is_composed(operands, place):
            return Operand(doubt=Doubt("RUN_TIME_POSE", f"{node.text} is composed of several positions"))
        # base * (P : F): whatever the operands mean, moving the first moves the product (DESIGN section 5)
        found = self._first(operands[0], place)
        if len(operands) == 1 or found.target is None:
            return found
        return Operand(found.target, found.doubt, self._product(operands[1:], place))

    def is_pose(self, node: Node, place: Place) -> bool:
        """Whether an expression is a point of its own: a literal, or a datum of such a type; frames are none."""
        if node.kind == "aggregate":
            value = value_of(node)
            return isinstance(value, Aggregate) and {"X", "Y", "Z", "A", "B", "C"} <= set(value.members)
        name = self.name_of(node, place) if node.kind == "reference" else None
        if name is None or bare_name(name.upper()) in place.local:
            return False
        symbol = self._symbols.find(name, place.module)
        return symbol is not None and symbol.type in _POINTS

    def constant(self, node: Node, place: Place) -> Symbol | None:
        """Datum that an expression names, if no code changes it."""
        if node.kind != "reference":
            return None
        name = self.name_of(node, place)
        return None if name is None else self.named(name, place)

    def named(self, name: str, place: Place) -> Symbol | None:
        """Datum of a name, if it is not the routine's own and no code changes it."""
        if bare_name(name.upper()) in place.local:
            return None
        symbol = self._symbols.find(name, place.module)
        return None if symbol is None or symbol.others or self._run_time.writes(symbol) else symbol

    def whole(self, node: Node, place: Place) -> int | None:
        """Whole number that an expression stands for; None where that is not known before the robot runs."""
        number = number_of(node)
        if number is None:
            symbol = self.constant(node, place)
            number = symbol.value if symbol is not None and not isinstance(symbol.value, (str, Aggregate)) else None
        if number is None or number.value != int(number.value):
            return None
        return int(number.value)

    def name_of(self, node: Node, place: Place) -> str | None:
        """Name of a reference with every index as a number; None where an index is computed while the robot runs."""
        name = "".join(node.text.split())
        if "[" not in name or all(_WHOLE.fullmatch(index) for index in _INDEX.findall(name)):
            return name
        text = ""
        for child in node.children:
            if not isinstance(child, Node):
                text += child.text
            elif child.kind == "index":
                numbers = [self.whole(index, place) for index in child.nodes]
                if not numbers or None in numbers:
                    return None
                text += f"[{','.join(map(str, numbers))}]"
            else:
                text += "".join(child.text.split())
        return text

    def _first(self, node: Node, place: Place) -> Operand:
        if node.kind == "aggregate":
            value = value_of(node)
            assert isinstance(value, Aggregate)  # noqa: S101
            return self._checked(self._targets.literal(place.name, place.path, value), node.text)
        text = "".join(node.text.split())
        if node.kind != "reference":
            return _unknown(f"{text} is computed while the robot runs")
        if text.upper() == _ORIGIN:
            message = f"{text} is the origin of the base or of the held part: no position in a file that could be moved"
            return Operand(doubt=Doubt("UNKNOWN_TARGET", message))
        if text.startswith("$"):
            return _unknown(f"{text} has its value while the robot runs")
        bare = bare_name(text.upper())
        if self._run_time.is_from_pose(bare, place.module):
            return _unknown(f"{text} is set to joints that are computed from a position")
        if bare in place.parameters:
            return _unknown(_parameter(text, bare, place))
        if bare in place.local:
            return _unknown(f"{text} is declared in the routine and has its position while the robot runs")
        name = self.name_of(node, place)
        if name is None:
            return _unknown(f"{text}: which element it is comes out while the robot runs")
        return self._declared(name, place)

    def _declared(self, name: str, place: Place) -> Operand:
        symbol = self._symbols.find(name, place.module)
        if symbol is None:
            return Operand() if self._forms.is_home(name) else Operand(doubt=self._missing(name))
        if symbol.others:
            others = " and ".join(f"{other.path}:{other.line}" for other in (symbol, *symbol.others)[:3])
            return Operand(
                doubt=Doubt("AMBIGUOUS_NAME", f"{name} is declared globally in more than one data list: {others}")
            )
        target = self._targets.declared(symbol)
        if target is None:
            return _unknown(f"{name} has no literal position")
        if self._run_time.writes(symbol) and target.kind is TargetKind.POSE:
            return Operand(target, Doubt("RUN_TIME_POSE", f"{name} is assigned to while the robot runs"))
        return self._checked(target, name)

    def _checked(self, target: Target | None, text: str) -> Operand:
        if target is None:
            return _unknown(f"{text} is no position")
        if target.unknown:
            return Operand(target, Doubt("RUN_TIME_POSE", f"{target.name}: {target.unknown}"))
        return Operand(target)

    def _missing(self, name: str) -> Doubt:
        hidden = self._symbols.hidden(name)
        if hidden is None:
            return Doubt("UNKNOWN_TARGET", f"{name} is not declared with a position in this backup")
        message = f"{name} is declared in {hidden.path}:{hidden.line}, but not for other modules (PUBLIC and GLOBAL)"
        return Doubt("UNKNOWN_TARGET", message)

    def _product(self, operands: Sequence[Node], place: Place) -> RigidTransform | None:
        """Shift that the operands behind the first make, as far as it is literal."""
        product = IDENTITY
        for operand in operands:
            found = self.frame_pose(operand, place)
            if found is None:
                return None
            product = product * found
        return product

    def frame_pose(self, node: Node, place: Place) -> RigidTransform | None:
        """Pose of a literal frame, or of a declared one that no code changes."""
        if node.kind == "aggregate":
            value: object = value_of(node)
        elif node.text.strip().upper() == _ORIGIN:
            return IDENTITY
        else:
            symbol = self.constant(node, place)
            value = None if symbol is None else symbol.value
        return frame_pose(value) if isinstance(value, Aggregate) else None

    def _is_composed(self, operands: Sequence[Node], place: Place) -> bool:
        """Whether any operand but the first is a position of its own."""
        for operand in operands[1:]:
            name = operand.text if operand.kind == "reference" else ""
            kind = place.local.get(bare_name(name.upper()))
            symbol = self._symbols.find(name, place.module) if name and kind is None else None
            kind = symbol.type if symbol is not None else kind
            if kind in POSITION_TYPES and kind != "FRAME":
                return True
        return False


def _unknown(text: str) -> Operand:
    return Operand(doubt=Doubt("RUN_TIME_POSE", text))


def _parameter(text: str, bare: str, place: Place) -> str:
    index = list(place.parameters).index(bare)
    given = [call for call in place.passed if index < len(call.arguments) and call.arguments[index]]
    told = ", ".join(f"{call.arguments[index]} ({call.path}:{call.line})" for call in given[:_MOST_CALLS])
    more = f" and {len(given) - _MOST_CALLS} more" if len(given) > _MOST_CALLS else ""
    return f"{text} is a parameter; callers pass {told or 'nothing that this backup tells'}{more}"


def _operands(node: Node) -> Iterator[Node]:
    """Operands of a frame product, from the left."""
    if node.kind in ("geometric", "group"):
        for child in node.nodes:
            yield from _operands(child)
    else:
        yield node
