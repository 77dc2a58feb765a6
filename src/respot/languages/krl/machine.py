"""Robot data of a KRC backup as plain values: ``$machine.dat``."""

from __future__ import annotations

from respot.languages.krl.symbols import Aggregate, Scope, Value
from respot.program.robot import Machine
from respot.program.targets import Number


def read_machine(scope: Scope | None) -> Machine:
    """Values of ``$machine.dat``; the model is ``$TRAFONAME``."""
    if scope is None:
        return Machine()
    values = {key: _plain(symbol.value) for key, symbol in scope.symbols.items() if symbol.value is not None}
    model = str(values.get("$TRAFONAME[]", "")).strip().lstrip("#").strip()
    paths = tuple(dict.fromkeys(symbol.path for symbol in scope.symbols.values()))
    return Machine(model, values, paths)


def _plain(value: Value | None) -> object:
    if isinstance(value, Number):
        return float(value.value)
    if isinstance(value, Aggregate):
        return {name: _plain(member) for name, member in value.members.items()}
    return "" if value is None else value.strip('"')
