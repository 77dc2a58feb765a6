"""What RAPID code changes while the robot runs: data it assigns to, and displacements of whole programs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from respot.languages.rapid.blocks import Routine as Block
from respot.languages.rapid.symbols import Module
from respot.program.statement import Node, Statement

_DISPLACING = frozenset(("pdispset", "pdispon"))
#: Motions that write where they found something into their second argument.
_SEARCHING = frozenset(("searchl", "searchc"))
#: Instructions and functions of RobotWare that write into data they are given.
_WRITING = frozenset(("strtoval", "unpackrawbytes", "readanybin", "readrawbytes", "getsysdata", "getdataval"))
_BY_REFERENCE = frozenset(("INOUT", "VAR", "PERS"))


def called(statement: Statement) -> Iterator[Node]:
    """Yield every call of a statement: instructions, also behind a compact IF, and functions in expressions."""
    if statement.shape.tree is not None and statement.kind not in ("data", "module", "procedure", "function", "trap"):
        for node in statement.node.walk():
            if node.kind in ("call", "function_call"):
                yield node


def name_of(call: Node) -> str:
    """Return the name that is called; empty where it is bound late."""
    names = call.tokens("NAME")
    return names[0].text if names else ""


@dataclass(frozen=True)
class RunTime:
    """What the code of a controller changes.

    Parameters
    ----------
    written : frozenset of str
        Data, in lower case, that code of the task changes, or any task changes and all of them share.
    twins : frozenset of str
        Persistent data, in lower case, that several tasks declare: each holds a copy of one value.
    displaced : str
        What displaces every position of the task; empty if nothing does.
    """

    written: frozenset[str]
    twins: frozenset[str]
    displaced: str


def read_run_time(tasks: Mapping[str, Sequence[Module]]) -> dict[str, RunTime]:
    """Read what the code of each task changes."""
    written = {task: set(_written(modules)) for task, modules in tasks.items()}
    declared = [
        {
            symbol.name.lower()
            for module in modules
            for symbol in module.symbols.values()
            if symbol.storage == "PERS" and not symbol.local
        }
        for modules in tasks.values()
    ]
    twins = frozenset(name for names in declared for name in names if sum(name in other for other in declared) > 1)
    everywhere = {name for names in written.values() for name in names}
    return {
        task: RunTime(frozenset(written[task] | (twins & everywhere)), twins, _displaced(modules))
        for task, modules in tasks.items()
    }


def _written(modules: Iterable[Module]) -> Iterator[str]:
    """Names that code assigns to, whole or in part, or hands to a routine that may."""
    known = list(modules)
    heads = {name: _by_reference(block) for module in known for name, block in module.routines.items()}
    for block in (block for module in known for block in module.routines.values()):
        for statement in block.body:
            if statement.shape.tree is None or statement.kind == "data":
                continue
            for node in statement.node.walk():
                if node.kind == "assignment":
                    yield node.nodes[0].nodes[0].text.lower()
                elif node.kind in ("call", "function_call"):
                    name = name_of(node).lower()
                    if name in heads:
                        yield from _handed(node, heads[name])
                    elif name in _SEARCHING:
                        yield from _handed(node, (False, True))
                    elif name in _WRITING:
                        yield from _references(node)


def _references(call: Node) -> Iterator[str]:
    """Yield every datum that a call gets, whole or in part."""
    arguments = call.first("arguments")
    for node in () if arguments is None else arguments.walk():
        if node.kind == "reference":
            yield node.nodes[0].text.lower()


def _handed(call: Node, by_reference: Sequence[bool]) -> Iterator[str]:
    arguments = call.first("arguments")
    if arguments is None:
        return
    positional = [node.nodes[0] for node in arguments.all("argument") if node.nodes]
    options = [node.nodes[0] for node in arguments.all("optional_argument", "named_argument") if node.nodes]
    for argument, changes in [*zip(positional, by_reference, strict=False), *((node, True) for node in options)]:
        if changes and argument.kind == "reference" and not _is_frame_option(argument, arguments):
            yield argument.nodes[0].text.lower()


def _is_frame_option(argument: Node, arguments: Node) -> bool:
    r"""Whether an argument is handed as ``\WObj``: a wrapper needs it PERS, and changes it only by assignment."""
    for option in arguments.all("optional_argument"):
        if option.nodes and option.nodes[0].span == argument.span:
            return option.tokens("NAME")[0].text.lower() == "wobj"
    return False


def _by_reference(block: Block) -> list[bool]:
    """Whether the routine may change each of its parameters; a tool or work object that is PERS has to be."""
    if block.head.shape.tree is None:
        return []
    found = []
    parameters = block.head.node.first("parameters")
    for node in [] if parameters is None else parameters.all("parameter"):
        names = [name.text.lower() for name in node.all("name")]
        access = [token.text.upper() for token in node.tokens("ACCESS")]
        own = names[-1] if names else ""
        found.append(bool(access) and access[0] in _BY_REFERENCE and _assigns(block, own))
    return found


def _assigns(block: Block, name: str) -> bool:
    """Whether a routine assigns to a parameter of its own, or hands it on."""
    for statement in block.body:
        if statement.shape.tree is None or statement.kind == "data":
            continue
        for node in statement.node.walk():
            if node.kind == "assignment" and node.nodes[0].nodes[0].text.lower() == name:
                return True
            if node.kind == "function_call" and any(
                part.kind == "reference" and part.text.lower() == name for part in node.walk()
            ):
                return True
    return False


def _displaced(modules: Iterable[Module]) -> str:
    for module in modules:
        for block in module.routines.values():
            for statement in block.body:
                for call in called(statement):
                    if name_of(call).lower() in _DISPLACING:
                        return f"{name_of(call)} at {module.path}:{statement.line} displaces the positions of this task"
    return ""
