"""What a reference means: the datum, its part by field and index, and the declared type of that part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from respot.languages.literals import number_of
from respot.languages.rapid.symbols import Module, Symbol, Task
from respot.languages.rapid.targets import Keys
from respot.program.statement import Node


@dataclass(frozen=True)
class Datum:
    """A datum or a part of it.

    Parameters
    ----------
    symbol : Symbol
        The datum.
    type : str
        Declared type of the part, aliases followed; empty where a field is not declared.
    keys : tuple of int
        Where the part stands: an index from 0 for each dimension and each field.
    dimensions : int
        How many indices the part still needs.
    unknown : str
        Why it is not known which part is meant.
    """

    symbol: Symbol
    type: str
    keys: Keys = ()
    dimensions: int = 0
    unknown: str = ""

    def value(self) -> Node | None:
        """Initial value of the part; None where the declaration has none."""
        node = self.symbol.node
        for key in self.keys:
            items = node.nodes if node is not None and node.kind == "aggregate" else []
            node = items[key] if key < len(items) else None
        return node


def resolve(node: Node, task: Task, module: Module, local: Mapping[str, Symbol]) -> Datum | None:
    """Return what a reference means; None if the task declares no such datum.

    Parameters
    ----------
    node : Node
        The reference.
    task, module, local :
        Where it stands.
    """
    symbol = task.find(first_word(node), module, local)
    if symbol is None:
        return None
    datum = whole(symbol, task, module)
    branch = node.branch
    for selector in node.nodes[1:] if branch.first != branch.last else ():
        datum = _part(datum, selector, task, module, local)
    return datum


def first_word(node: Node) -> str:
    """Return the first word of an expression: of a reference, the datum."""
    return node.source[slice(*node.token_spans[node.branch.first])]


def whole(symbol: Symbol, task: Task, module: Module) -> Datum:
    """Return a datum as a whole."""
    return Datum(symbol, task.type_of(symbol.type, module), (), symbol.dimensions)


def _part(datum: Datum, selector: Node, task: Task, module: Module, local: Mapping[str, Symbol]) -> Datum:
    if selector.kind == "index":
        numbers = [_index(node, task, module, local) for node in selector.nodes]
        left = max(datum.dimensions - len(numbers), 0)
        if any(number is None or number < 1 for number in numbers):
            return replace(datum, dimensions=left, unknown="is chosen while the robot runs")
        return replace(
            datum, keys=(*datum.keys, *(number - 1 for number in numbers if number is not None)), dimensions=left
        )
    fields = task.fields(datum.type, module)
    name = selector.nodes[0].text.lower()
    place = next((place for place, field in enumerate(fields or ()) if field[1] == name), None)
    if fields is None or place is None:
        reason = f"has the type {datum.type or datum.symbol.type}, whose field {name} is not declared in this backup"
        return replace(datum, type="", unknown=datum.unknown or reason)
    return replace(datum, type=task.type_of(fields[place][0], module), keys=(*datum.keys, place))


def _index(node: Node, task: Task, module: Module, local: Mapping[str, Symbol]) -> int | None:
    """Value of an index: a number, or a constant that is one."""
    number = number_of(node)
    if number is None and node.kind == "reference" and len(node.nodes) == 1:
        symbol = task.find(node.text, module, local)
        value = symbol.node if symbol is not None and symbol.storage == "CONST" else None
        number = None if value is None else number_of(value)
    if number is None or number.value != int(number.value):
        return None
    return int(number.value)
