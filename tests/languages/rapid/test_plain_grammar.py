"""Made-up statements, however they are laid out: the fast path gives what the plain grammar gives for a file."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator

from hypothesis import given, settings
from hypothesis import strategies as st
from lark import Tree

from respot.languages.rapid.syntax import ENCODINGS, NO_STATEMENT, SHAPES, TOKEN, read_statements
from respot.program.statement import Node, Statement
from respot.source import SourceText

NAMES = st.sampled_from(["a", "p10", "tGun", "x1", "Übung", "error1", "id", "iffy", "mod_1", "EXPO", "doIt", "<EXP>"])
PLAIN_NAMES = NAMES.filter(lambda name: name[0] != "<")
NUMBERS = st.sampled_from(["0", "1", "9E9", "9e+09", "1.", ".5", "1.5E-05", "0x1F", "0b101", "12345678"])
STRINGS = st.sampled_from(['""', '"a"', '"say ""yes"""', '"! ; IF"', '"\\0D"', '"[1,2]"'])
LITERALS = st.one_of(NUMBERS, STRINGS, st.sampled_from(["TRUE", "false"]))


def _words(*parts: object) -> st.SearchStrategy[list[str]]:
    """Tokens of parts in a row: words as they are, strategies of words or of lists of words."""
    strategies = [part if isinstance(part, st.SearchStrategy) else st.just(part) for part in parts]
    return st.tuples(*strategies).map(
        lambda found: [word for part in found for word in (part if isinstance(part, list) else [part])]
    )


def _listed(items: st.SearchStrategy, fewest: int = 0, most: int = 3) -> st.SearchStrategy[list[str]]:
    return st.lists(items, min_size=fewest, max_size=most).map(
        lambda found: [word for index, item in enumerate(found) for word in ([","] * (index > 0) + list(item))]
    )


def _grown(inner: st.SearchStrategy[list[str]]) -> st.SearchStrategy[list[str]]:
    operator = st.sampled_from(["+", "-", "*", "/", "DIV", "mod", "AND", "OR", "xor", "=", "<>", "<=", ">", "<"])
    closed = _words("(", inner, ")")
    return st.one_of(
        _words(closed, operator, closed),
        _words("-", closed),
        _words("(", "NOT", inner, ")"),
        _words("[", _listed(inner), "]"),
        _words(PLAIN_NAMES, "(", _arguments(inner), ")"),
        _words(NAMES, "{", _listed(inner, 1), "}", ".", PLAIN_NAMES),
        closed,
    )


def _arguments(inner: st.SearchStrategy[list[str]]) -> st.SearchStrategy[list[str]]:
    argument = st.one_of(inner, _words(PLAIN_NAMES, ":=", inner))
    option = st.one_of(
        _words("\\", PLAIN_NAMES), _words("\\", PLAIN_NAMES, ":=", inner), _words("\\", PLAIN_NAMES, "?", PLAIN_NAMES)
    )
    options = st.lists(st.tuples(st.booleans(), option), max_size=2).map(
        lambda found: [word for comma, item in found for word in ([","] * comma + item)]
    )
    return st.one_of(st.just([]), option, _words(_listed(argument, 1), options))


EXPRESSIONS = st.recursive(st.one_of(LITERALS, NAMES).map(lambda word: [word]), _grown, max_leaves=8)
REFERENCES = st.one_of(_words(NAMES), _words(NAMES, "{", EXPRESSIONS, "}"), _words(NAMES, ".", PLAIN_NAMES))
CALLS = st.one_of(
    _words(PLAIN_NAMES, _arguments(EXPRESSIONS), ";"), _words("%", EXPRESSIONS, "%", _arguments(EXPRESSIONS), ";")
)
SIMPLE = st.one_of(
    _words(REFERENCES, ":=", EXPRESSIONS, ";"),
    CALLS,
    _words("GOTO", NAMES, ";"),
    _words("RETURN", st.one_of(st.just([]), EXPRESSIONS), ";"),
    st.sampled_from([["EXIT", ";"], ["RETRY", ";"], ["TRYNEXT", ";"], ["RAISE", ";"]]),
    _words("CONNECT", REFERENCES, "WITH", NAMES, ";"),
)
TYPED = _words(PLAIN_NAMES, PLAIN_NAMES)
PARAMETERS = st.one_of(
    TYPED,
    _words(st.sampled_from(["VAR", "PERS", "INOUT"]), TYPED),
    _words(TYPED, "{", "*", ",", "*", "}"),
)
STATEMENTS = st.one_of(
    SIMPLE,
    _words("IF", EXPRESSIONS, SIMPLE),
    _words("IF", EXPRESSIONS, "THEN"),
    _words("ELSEIF", EXPRESSIONS, "THEN"),
    _words("FOR", NAMES, "FROM", EXPRESSIONS, "TO", EXPRESSIONS, "DO"),
    _words("WHILE", EXPRESSIONS, "DO"),
    _words("TEST", EXPRESSIONS, "CASE", _listed(EXPRESSIONS, 1), ":"),
    _words("DEFAULT", ":"),
    _words(PLAIN_NAMES, ":"),
    st.sampled_from(["ELSE", "ENDIF", "ENDFOR", "ENDWHILE", "ENDTEST", "ERROR", "UNDO", "BACKWARD", "<SMT>"]).map(
        lambda word: [word]
    ),
    _words("ERROR", "(", _listed(EXPRESSIONS, 1), ")"),
    _words(st.sampled_from(["VAR", "PERS", "CONST"]), TYPED, ";"),
    _words(st.sampled_from(["LOCAL", "TASK"]), "PERS", TYPED, "{", NUMBERS, "}", ":=", EXPRESSIONS, ";"),
    _words("PROC", PLAIN_NAMES, "(", _listed(PARAMETERS), ")"),
    _words("LOCAL", "FUNC", TYPED, "(", _listed(PARAMETERS), "\\", PARAMETERS, ")"),
    _words("TRAP", PLAIN_NAMES),
    _words("RECORD", PLAIN_NAMES),
    _words("LOCAL", "ALIAS", TYPED, ";"),
    st.sampled_from(["ENDPROC", "ENDFUNC", "ENDTRAP", "ENDRECORD"]).map(lambda word: [word]),
)
#: What may stand between two tokens; a statement goes on further right than it begins.
GAPS = st.sampled_from(
    [" ", " ", " ", "  ", "\t", "\n    ", "\r\n\t\t\t", " ! a; comment\n      ", "\n\n     ! IF\n    "]
)
ENDS = st.sampled_from(["\n", "\r\n", "\r", "\n\n", " ! c\n", " ", "\r\r\n"])


@st.composite
def _modules(draw: st.DrawFn) -> str:
    text = ""
    for words in draw(st.lists(STATEMENTS, min_size=1, max_size=4)):
        if words[0].startswith("("):
            continue
        text += words[0] + "".join(draw(GAPS) + word for word in words[1:]) + draw(ENDS)
    return text


def _plain(tree: Tree) -> tuple:
    children = (child for child in tree.children if child is not None)
    inner = [
        _plain(child) if isinstance(child, Tree) else (child.type, child.start_pos, child.end_pos) for child in children
    ]
    span = (0, 0) if tree.meta.empty else (tree.meta.start_pos, tree.meta.end_pos)
    return (str(tree.data), *span, *inner)


def _fast(node: Node) -> tuple:
    inner = [_fast(child) if isinstance(child, Node) else (child.type, *child.span) for child in node.children]
    return (node.kind, *node.span, *inner)


@settings(max_examples=400, deadline=None)
@given(_modules())
def test_statements(text: str) -> None:
    plain = SHAPES.lark.parse(text, start="file").children
    source = SourceText("a.mod", text.encode(), ENCODINGS)
    ours = read_statements(source.text, source.line_starts)
    assert [_plain(piece) for piece in plain] == [_fast(found.node) for found in ours if found.kind not in NO_STATEMENT]


@settings(max_examples=200, deadline=None)
@given(_modules())
def test_tokens(text: str) -> None:
    ours = [found.span() for found in TOKEN.finditer(text) if found.lastgroup != "comment"]
    assert ours == [(token.start_pos, token.end_pos) for token in SHAPES.lark.lex(text)]


@settings(max_examples=300, deadline=None)
@given(st.text(alphabet='abIF THENDO1.9Ee+-*:=;,\\"!%<>[](){}?|\n\r\t\x1aÜ&#_0xb', max_size=60))
def test_any_text(text: str) -> None:
    """Whatever stands in a file is in a statement or is a gap, and the spans are in order."""
    source = SourceText("a.mod", text.encode(), ENCODINGS)
    position = 0
    for statement in read_statements(source.text, source.line_starts):
        assert position <= statement.start < statement.end
        assert _is_gap(source.text[position : statement.start])
        assert statement.line == source.place(statement.start)[0]
        position = statement.end
    assert _is_gap(source.text[position:])


def _is_gap(text: str) -> bool:
    return not re.sub(r"![^\r\n]*", "", text).strip("\x1a \t\r\n")


def test_numbers_of_literals_with_any_signs() -> None:
    """Statements that differ in signs share a pattern: every number has its own sign and place, first met or not."""
    dice = random.Random(3)
    texts = []
    for index in range(400):
        signs = [dice.choice(["", "-", "+", "- "]) for _ in range(5)]
        first, second, third, fourth, fifth = (f"{sign}{dice.randrange(1, 99)}.5" for sign in signs)
        texts += [
            f"CONST t p{index}{{{index}}}:=[[{first},{second}],TRUE,[{third}]];",
            f'MoveL Offs([{first},0x1F],{fourth}-2,-(3)),v{index},[{second},"-1",{fifth}]; ! -1',
        ]
    statements = _statements("\n".join(texts))
    for text, statement in zip(texts, statements, strict=True):
        plain = SHAPES.lark.parse(text, start="piece")
        expected = sorted(_numbers(plain))
        found = statement.numbers()
        begin = statement.start
        assert [(start - begin, end - begin) for start, end in found.spans] == expected
        assert [text[start:end] for start, end in expected] == list(found.texts)
        assert _plain(plain) == _shifted(_fast(statement.node), begin)


def _statements(text: str) -> list[Statement]:
    source = SourceText("a.mod", text.encode(), ENCODINGS)
    return read_statements(source.text, source.line_starts)


def _numbers(tree: Tree) -> Iterator[tuple[int, int]]:
    inner = tree
    while inner.data == "signed" and isinstance(inner.children[-1], Tree):
        inner = inner.children[-1]
    if inner.data == "number":
        yield tree.meta.start_pos, tree.meta.end_pos
        return
    for child in tree.children:
        if isinstance(child, Tree):
            yield from _numbers(child)


def _shifted(tree: tuple, by: int) -> tuple:
    kind, start, end, *inner = tree
    return (kind, start - by, end - by, *(_shifted(child, by) for child in inner))
