"""The fast path gives what the plain grammar gives: the same tokens, the same trees, the same spans, the same numbers.

Statements are made from the grammar's own rules, so that no rule is forgotten.
"""

from __future__ import annotations

import re
from functools import cache

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lark import Token, Tree
from lark.exceptions import UnexpectedInput
from lark.grammar import NonTerminal

from respot.languages.krl.syntax import NO_STATEMENT, SHAPES, read_statements
from respot.program.statement import Node, Numbers, number

NAMES = [
    "XP1",
    "a",
    "$OUT",
    "I_2",
    "START",
    "path",
    "Pos",
    "E6POS",
    "INT",
    "TO",
    "on",
    "PART",
    "WITH",
    "B_1",
    "if_x",
    "E1",
]
NUMBERS = ["0", "12", "1.5", "1.", ".5", "1E3", "2.80000E+06", "1e-05", "003"]
#: What the regular expressions of the grammar stand for.
SAMPLES = {
    "NAME": NAMES,
    "NUMBER": NUMBERS,
    "STRING": ['""', '"a"', '"; IF {"', '"\\"', '"x 1,5"'],
    "BITS": ["'B0110'", "'h1F'", "'12'"],
    "HEADER": ["&ACCESS RVP", "& REL 1", "&x \" ; '"],
    "IMPORT_PATH": ["/R1/MODULE..X", "/R1/$CONFIG..N"],
    "TYPE_NAME": ["INT", "real", "E6POS", "Frame", "E3AXIS", "pos"],
    "GLOBAL": ["GLOBAL"],
    "PUBLIC": ["PUBLIC"],
    "CONST": ["CONST"],
    "DIRECTION": ["IN", "OUT"],
    "ONSTART": ["ONSTART"],
    "MOVE": ["PTP", "LIN", "SPTP", "SLIN", "SPL"],
    "MOVE_REL": ["PTP_REL", "SLIN_REL"],
    "MOVE_CIRC": ["CIRC", "SCIRC", "CIRC_REL"],
    "RELATIVE_TO": ["BASE", "TOOL"],
    "APPROXIMATION": ["C_PTP", "C_DIS", "C_SPL"],
    "SPLINE": ["SPLINE", "PTP_SPLINE"],
    "BLOCK_EDGE": ["START", "PART", "END"],
    "BRAKE_KIND": ["F", "FF"],
    "SWITCH_WORD": ["ON", "OFF", "ENABLE", "DISABLE"],
    "TRIGGER_AT": ["DISTANCE", "PATH"],
    "ON": ["ON"],
    "OFF": ["OFF"],
    "BOOLEAN": ["TRUE", "FALSE"],
    "COMPARATOR": ["==", "<>", "<=", ">=", "<", ">"],
    "OR": ["OR", "B_OR"],
    "EXOR": ["EXOR", "B_EXOR"],
    "AND": ["AND", "B_AND"],
    "NOT": ["NOT", "B_NOT"],
    "SIGN": ["+", "-"],
    "SCALE": ["*", "/"],
}
GAPS = st.sampled_from(["", " ", "  ", "\t", " \xa0", "\x1a "])


@cache
def _rules() -> dict[str, list[list[object]]]:
    """Every rule's expansions, the shortest way to an end first."""
    rules: dict[str, list[list[object]]] = {}
    for rule in SHAPES.lark.rules:
        rules.setdefault(str(rule.origin.name), []).append(list(rule.expansion))
    heights = dict.fromkeys(rules, 99)
    for _ in range(len(rules)):
        for name, expansions in rules.items():
            heights[name] = min(heights[name], *(1 + _height(expansion, heights) for expansion in expansions))
    for expansions in rules.values():
        expansions.sort(key=lambda expansion: _height(expansion, heights))
    return rules


def _height(expansion: list[object], heights: dict[str, int]) -> int:
    return max((heights[str(item.name)] for item in expansion if isinstance(item, NonTerminal)), default=0)


@cache
def _literals() -> dict[str, str]:
    """Terminals that are a fixed text."""
    return {term.name: term.pattern.value for term in SHAPES.lark.terminals if term.name not in SAMPLES}


def _tokens(draw: st.DrawFn, name: str, depth: int) -> list[str]:
    expansions = _rules()[name]
    expansion = expansions[0] if depth > 16 else draw(st.sampled_from(expansions))
    tokens: list[str] = []
    for item in expansion:
        if isinstance(item, NonTerminal):
            tokens += _tokens(draw, str(item.name), depth + 1)
        elif item.name in SAMPLES:
            tokens.append(draw(st.sampled_from(SAMPLES[item.name])))
        elif item.name[0] == "_":
            tokens.append(item.name[1:])  # a word of the language
        else:
            tokens.append(_literals()[item.name])
    return tokens


@st.composite
def statements(draw: st.DrawFn) -> str:
    """A statement in any layout that keeps its tokens apart."""
    text = ""
    for token in _tokens(draw, "statement", 0):
        token = draw(st.sampled_from([token, token.lower(), token.upper()])) if token[0].isalpha() else token
        gap = draw(GAPS)
        if text and not gap and _joins(text[-1], token[0]):
            gap = " "
        text += gap + token
    return text.strip(" \t\xa0\x1a") + draw(st.sampled_from(["", "", ";", ' ; IF (" x']))


def _joins(left: str, right: str) -> bool:
    return all(character.isalnum() or character in "_$.<>=/" for character in (left, right))


def _plain(tree: Tree[Token], start: int) -> object:
    span = (0, 0) if tree.meta.empty else (start + tree.meta.start_pos, start + tree.meta.end_pos)
    children = [
        _plain(child, start) if isinstance(child, Tree) else _token(child, start)
        for child in tree.children
        if child is not None
    ]
    return str(tree.data), span, children


def _token(token: Token, start: int) -> object:
    assert token.start_pos is not None and token.end_pos is not None
    kind = "NAME" if token.type.endswith("_NAME") else token.type
    return kind, str(token), (start + token.start_pos, start + token.end_pos)


def _fast(node: Node) -> object:
    children = [_fast(child) if isinstance(child, Node) else tuple(child) for child in node.children]
    return node.kind, node.span, children


def _numbers(node: Node, path: tuple[str, ...] = ()) -> list[tuple[str, float, tuple[int, int]]]:
    """Numbers of a tree, found in the tree."""
    found = []
    for place, child in enumerate(node.nodes, 1):
        inner, negative = child, False
        while inner.kind == "signed":
            negative ^= inner.tokens("SIGN")[0].text == "-"
            inner = inner.nodes[-1]
        below: tuple[str, ...] = path if (node.kind, child.kind) == ("aggregate", "member") else ()
        if node.kind == "member" and place == len(node.nodes) and child.kind in ("number", "signed", "aggregate"):
            below = (*path, node.tokens("NAME")[0].text.upper())
        if inner.kind == "number":
            value = float(inner.text)
            found.append((".".join(below), -value if negative else value, child.span))
        else:
            found += _numbers(child, below)
    return found


def _listed(numbers: Numbers) -> list[tuple[str, float, tuple[int, int]]]:
    return list(zip(numbers.names, numbers.values, numbers.spans, strict=True))


def check(text: str) -> bool:
    """Compare both readings of one line; whether the grammar knows it."""
    [statement] = read_statements(text, [0])
    lexed = [text[slice(*span)] for span in statement.tokens()]
    try:
        tree = SHAPES.lark.parse(text, start="line")
    except UnexpectedInput:
        assert statement.kind == "opaque"
        return False
    assert _fast(statement.node) == _plain(tree, 0)
    tokens = SHAPES._parser.lark.parse(text).scan_values(lambda value: isinstance(value, Token))
    assert lexed == [str(token) for token in tokens]
    shape = statement.shape
    for used in (0, 1_000):  # token by token, and by the pattern of the shape
        shape._used = used
        assert _listed(statement.numbers()) == _numbers(statement.node)
        assert [text[slice(*span)] for span in statement.tokens()] == lexed
    return True


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(statements())
def test_made_up_statements(text):
    check(text)


@settings(max_examples=300, deadline=None)
@given(st.text(alphabet="aB1.;\"'#&/=<>:+-*(){}[],$_ \t\x00\x0b\x1c\x85\u2028!\xe9E", min_size=1, max_size=12))
def test_any_characters(text):
    if text.strip(" \t\f\x1a\xa0") and not text.strip(" \t\f\x1a\xa0").startswith(";"):
        check(text.strip(" \t\f\x1a\xa0"))


def test_most_made_up_statements_are_known():
    known = []

    @settings(max_examples=60, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(statements())
    def run(text):
        known.append(check(text))

    run()
    assert sum(known) > 0.6 * len(known)


def test_every_terminal_has_samples():
    named = {term.name for term in SHAPES.lark.terminals if term.pattern.type == "re" and term.name[0] != "_"}
    assert named <= {*SAMPLES, "COMMENT", "BLANK"}
    words = {term for term in SHAPES.lark.terminals if term.name[0] == "_" and term.name != "_NL"}
    assert all(re.fullmatch(term.pattern.to_regexp(), term.name[1:]) for term in words)


def test_fixtures(program, read):
    source, found = read(program.read_bytes())
    kept = [statement for statement in found if statement.kind not in NO_STATEMENT]
    for statement in kept:
        tree = SHAPES.lark.parse(statement.source, start="line")
        assert _fast(statement.node) == _plain(tree, statement.start)
        assert check(statement.source)
    # the whole file, as any reader of the grammar would parse it
    whole = SHAPES.lark.parse(source.text, start="file")
    assert [_plain(tree, 0) for tree in whole.children] == [_fast(statement.node) for statement in kept]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0),
        ("-1.5", -1.5),
        ("- 5", -5.0),
        ("-\t.5", -0.5),
        ("0x1F", 31.0),
        ("--2", 2.0),
        ("+ - 3", -3.0),
        ("1E3", 1000.0),
    ],
)
def test_number(text, value):
    assert number(text) == value
