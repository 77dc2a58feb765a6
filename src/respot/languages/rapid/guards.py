"""Which optional parameters must have been given where a statement runs: ``IF Present(WObj) THEN`` .. ``ELSE``."""

from __future__ import annotations

from collections.abc import Mapping

from respot.languages.rapid.calls import Line
from respot.languages.rapid.drafts import Guard
from respot.languages.rapid.symbols import Symbol
from respot.program.statement import Node

_BLOCKS = {"if_": "end_if", "for_": "end_for", "while_": "end_while", "test": "end_test"}
_ENDS = frozenset(_BLOCKS.values())


class Guards:
    """Follows the IF blocks of a routine.

    Parameters
    ----------
    local : mapping of str to Symbol
        Parameters and data of the routine.
    """

    def __init__(self, local: Mapping[str, Symbol]) -> None:
        self._local = local
        #: of each open block: guards of its current branch, and what holds in its further branches
        self._open: list[tuple[tuple[Guard, ...], tuple[Guard, ...]]] = []
        self._relevant = any(symbol.storage == "parameter" for symbol in local.values())

    def at(self, line: Line) -> tuple[Guard, ...]:
        """Return the guards of a statement; statements must be told in order."""
        if not self._relevant:
            return ()
        kind = line.statement.kind
        if kind in _ENDS:
            if self._open:
                self._open.pop()
        elif kind in ("elseif", "else_") and self._open:
            others = self._open.pop()[1]
            found = self._condition(line) if kind == "elseif" else None
            self._open.append((others if found is None else (*others, found), (*others, *_opposite(found))))
        elif kind in _BLOCKS:
            found = self._condition(line) if kind == "if_" else None
            self._open.append((() if found is None else (found,), _opposite(found)))
        elif kind == "compact_if" and (found := self._condition(line)) is not None:
            return (*self._all(), found)
        return self._all()

    def _all(self) -> tuple[Guard, ...]:
        return tuple(guard for guards, _ in self._open for guard in guards)

    def _condition(self, line: Line) -> Guard | None:
        if not any(call.name.lower() == "present" for call in line.calls):
            return None
        node, wanted = line.statement.node.nodes[0], True
        while node.kind in ("group", "negation"):
            wanted ^= node.kind == "negation"
            node = node.nodes[-1]
        name = _asked(node)
        symbol = self._local.get(name)
        return (name, wanted) if symbol is not None and symbol.storage == "parameter" else None


def _opposite(guard: Guard | None) -> tuple[Guard, ...]:
    return () if guard is None else ((guard[0], not guard[1]),)


def _asked(node: Node) -> str:
    """Name in ``Present(name)``, in lower case; empty for any other condition."""
    if node.kind != "function_call" or node.tokens("NAME")[0].text.lower() != "present":
        return ""
    arguments = node.first("arguments")
    return "" if arguments is None or not arguments.nodes else arguments.nodes[0].text.lower()
