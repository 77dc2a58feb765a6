"""Five hundred small damages: what somebody breaks by hand is noticed, at the right line."""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Callable, Iterator

from respot.languages.rapid.blocks import BLOCKS, ROUTINES, block_issues
from respot.languages.rapid.syntax import ENCODINGS, NO_STATEMENT, read_statements
from respot.program.statement import OPAQUE, Statement
from respot.source import SourceText

Place = tuple[int, str]  # line and what is wrong there
#: A damage: the damaged text and the lines at which it may be noticed.
Damage = tuple[str, set[int]]

TARGET = "[[{0}.5,-{0},{0}E1],[1,0,0,0],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


def _program(dice: random.Random) -> str:
    """A module as people write them: data, routines, blocks within blocks."""
    lines = ["MODULE Spots", "  ! made up", "  RECORD station", "    num id;", "    robtarget place;", "  ENDRECORD"]
    for index in range(dice.randrange(3, 9)):
        lines.append(f"  CONST robtarget p{index}0:={TARGET.format(index)};")
        lines.append(f"  {dice.choice(['', 'LOCAL ', 'TASK '])}PERS num n{index}:={index};")
    for index in range(dice.randrange(2, 5)):
        lines += ["", f"  PROC r{index}(num a\\switch fast)", "    VAR num b:=0;", *_block(dice, 4, 3)]
        if dice.random() < 0.3:
            lines += ["  ERROR", "    IF ERRNO=ERR_A RETRY;", "    TRYNEXT;"]
        lines.append("  ENDPROC")
    lines += ["", "  FUNC num f(num x)", "    RETURN x*2;", "  ENDFUNC", "ENDMODULE", ""]
    return "\n".join(lines)


def _block(dice: random.Random, column: int, depth: int) -> list[str]:
    gap = " " * column
    lines: list[str] = []
    for _ in range(dice.randrange(2, 5)):
        n = dice.randrange(9)
        simple = [
            f"MoveL p{n}0,v100,z10,tGun\\WObj:=wPart;",
            f"b:=b+f({n})*2;",
            f"SpotL {TARGET.format(n)},vmax,gun1,sd{n},tGun;",
            f'TPWrite "station "+ValToStr(b)\\Num:={n};',
            f"IF b={n} GOTO done{n};\n{gap}done{n}:",
        ]
        if depth == 0 or dice.random() < 0.5:
            lines.append(gap + dice.choice(simple))
            continue
        first, second = (_block(dice, column + 2, depth - 1) for _ in range(2))
        blocks = [
            [f"IF b={n} AND NOT fast THEN", *first, f"{gap}ENDIF"],
            [f"IF b={n} AND NOT fast THEN", *first, f"{gap}ELSE", *second, f"{gap}ENDIF"],
            [f"FOR i FROM 1 TO {n} DO", *first, f"{gap}ENDFOR"],
            [f"WHILE b<{n} DO", *first, f"{gap}ENDWHILE"],
            ["TEST b", f"{gap}CASE 1,2:", *first, f"{gap}DEFAULT:", *second, f"{gap}ENDTEST"],
        ]
        chosen = dice.choice(blocks)
        lines += [gap + chosen[0], *chosen[1:]]
    return lines


def _read(text: str) -> list[Statement]:
    source = SourceText("a.mod", text.encode(), ENCODINGS)
    return read_statements(source.text, source.line_starts)


def _findings(text: str) -> Counter[int]:
    """Lines with something wrong."""
    statements = _read(text)
    found = Counter(statement.line for statement in statements if statement.kind == OPAQUE)
    found.update(issue.line or 0 for issue in block_issues("a.mod", statements))
    return found


def _partners(statements: list[Statement]) -> dict[int, int]:
    """Line of the head for each line that ends a block, and the reverse."""
    ends = {**BLOCKS, **ROUTINES, "record": "end_record", "module": "end_module"}
    heads: list[Statement] = []
    partners: dict[int, int] = {}
    for statement in statements:
        if statement.kind in ends:
            heads.append(statement)
        elif statement.kind in ends.values():
            head = heads.pop()
            partners[head.line], partners[statement.line] = statement.line, head.line
    return partners


def _replace(pattern: str, replacement: str) -> Callable[[str], Iterator[tuple[int, int, str]]]:
    def places(text: str) -> Iterator[tuple[int, int, str]]:
        for match in re.finditer(pattern, text, re.MULTILINE):
            yield match.start(), match.end(), match.expand(replacement)

    return places


#: What is done to a text; blanks and comments are left alone.
DAMAGES = {
    "lost semicolon": _replace(r";$", ""),
    "= for :=": _replace(r":=", "="),
    ":= for =": _replace(r"(?<=IF b)=", ":="),
    "cut bracket": _replace(r"[\[\]]", ""),
    "cut parenthesis": _replace(r"(?<=\w)[()]|[()](?=[;*+])", ""),
    "cut quote": _replace(r'"', ""),
    "lost comma": _replace(r",(?=[\[vz])", ""),
    "two commas": _replace(r",(?=[\w\[])", ",,"),
    "lost end": _replace(r"^ *END\w+\n", ""),
    "lost head": _replace(r"^ *(?:IF .* THEN|FOR|WHILE|TEST|PROC|FUNC|RECORD)\b.*\n", ""),
    "lost word": _replace(r" (?:THEN|DO)$", ""),
    "lost colon": _replace(r"(?<=[0-9T]):$", ""),
    "letter in a word": _replace(r"\b(END|MODULE|PROC|CONST|PERS)(?=\w*\b)", r"x\1"),
    "strange character": _replace(r"(?<=[=,(])(?=\w)", "#"),
    "number with two points": _replace(r"\.5", ".5.5"),
    "semicolon for comma": _replace(r",(?=[\[vz])", ";"),
    "lost name": _replace(r"(?<=PROC )r\d|(?<=robtarget )p\d+|(?<=\\)WObj", ""),
    "line cut short": _replace(r"(?<=[,(\[=+]).{3,}$", ""),
}


def _damage(text: str, kind: str, dice: random.Random) -> Damage | None:
    places = list(DAMAGES[kind](text))
    if not places:
        return None
    start, end, replacement = dice.choice(places)
    line = text.count("\n", 0, start) + 1
    statements = [found for found in _read(text) if found.kind not in NO_STATEMENT]
    lines = {line}
    partner = _partners(statements).get(line)
    if partner is not None:
        # a block without its end is seen at its head, and one without its head at its end
        lines.add(partner - (kind == "lost head" and partner > line))
    if kind == "lost head":
        # what followed the head now stands where nothing of the kind can
        dividers = [found.line for found in statements if found.kind in ("else_", "case", "default")]
        lines.update(found - 1 for found in dividers if line < found < (partner or 0))
    return text[:start] + replacement + text[end:], lines


def test_damages_are_noticed() -> None:
    dice = random.Random(20)
    missed: list[str] = []
    count = 0
    kinds = sorted(DAMAGES)
    while count < 500:
        kind = kinds[count % len(kinds)]
        text = _program(dice)
        assert not _findings(text)
        damaged = _damage(text, kind, dice)
        if damaged is None:
            continue
        count += 1
        after, lines = damaged
        if not lines & set(_findings(after)):
            old, new = text.splitlines(), after.splitlines()
            first = next((i for i, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), 0)
            missed.append(f"{kind}: line {sorted(lines)} {old[first]!r}, noticed {sorted(_findings(after))}")
    assert len(missed) <= 25, f"{len(missed)} of 500\n" + "\n".join(missed)
