"""Damage done to sound programs is noticed, and at the right line: 95 of 100 at least, over 500 seeded damages.

Noticed means a new opaque statement or a new issue. The right line is the damaged one; where a line that opens or closes a
block is gone, it is the other end of that block.
"""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from respot.languages.krl.blocks import block_issues
from respot.languages.krl.syntax import ENCODINGS, read_statements
from respot.program.statement import OPAQUE
from respot.source import SourceText

DATA = Path(__file__).parents[2] / "data" / "krl"
PROGRAMS = [
    path for path in sorted(DATA.iterdir()) if path.suffix in (".src", ".dat") and "unbalanced" not in path.name
]

#: A damage takes a line and returns what is left of it, or None if it does not apply.
Damage = Callable[[random.Random, str], str | None]


def _replace(pattern: str, replacement: str) -> Damage:
    def damage(dice: random.Random, line: str) -> str | None:
        found = list(re.finditer(pattern, line, re.IGNORECASE))
        if not found:
            return None
        place = dice.choice(found)
        return line[: place.start()] + place.expand(replacement) + line[place.end() :]

    return damage


DAMAGES: dict[str, Damage] = {
    ":= for =": _replace(r"(?<![=<>:])=(?!=)", ":="),
    "== for =": _replace(r"(?<![=<>:])=(?!=)", "=="),
    "= for ==": _replace(r"==", "="),
    "a cut brace": _replace(r"[{}]", ""),
    "a cut parenthesis": _replace(r"[()]", ""),
    "a cut bracket": _replace(r"[][]", ""),
    "a cut quote": _replace(r'"', ""),
    "a cut THEN": _replace(r"\s*\bTHEN\b", ""),
    "a cut comma between members": _replace(r"(?<=\d),(?=[A-Z])", " "),
    "a comma for a point": _replace(r"(?<=\d)\.(?=\d)", ","),
    "a doubled operator": _replace(r"(?<=\w)([*/])(?=[\w$(])", r"\1\1"),
    "a misspelt word": _replace(r"\b(PTP|LIN|CIRC|DECL|WAIT|IF|WHILE|FOR|UNTIL|RETURN|TRIGGER|DEF|SWITCH)\b", r"\1Q"),
    "two words run together": _replace(r"\b(DECL|WAIT|PTP|LIN|FOR|INTERRUPT|TRIGGER|RETURN|ENUM|SIGNAL) +", r"\1"),
    "the end of the line cut off": lambda dice, line: line[: len(line) // 2] if re.search(r"[({\[]", line) else None,
    "rubbish in the line": lambda dice, line: line + dice.choice((" ?", " @", " 5 5", " }", " )")),
}
_ENDS = r"\s*(END\w*|UNTIL\b.*)\s*(;.*)?$"


def _findings(text: str) -> Counter[int]:
    source = SourceText("a.src", text.encode("cp1252"), ENCODINGS)
    statements = read_statements(source.text, source.line_starts)
    lines = Counter(statement.line for statement in statements if statement.kind == OPAQUE)
    lines.update(issue.line for issue in block_issues("a.src", statements) if issue.line)
    return lines


def _blocks(lines: list[str]) -> dict[int, int]:
    """Line of the end of each block -> line where it begins, in a sound program."""
    opened, found = [], {}
    for number, line in enumerate(lines, 1):
        code = line.split(";")[0].strip().upper()
        if re.match(r"(GLOBAL )?DEF(FCT|DAT)?\b|IF\b|FOR\b|WHILE\b|REPEAT\b|LOOP\b|SWITCH\b|(PTP_)?SPLINE\b", code):
            opened.append(number)
        elif re.match(r"END|UNTIL\b", code):
            found[number] = opened.pop()
    return found


def _one(dice: random.Random) -> tuple[str, str, set[int], str] | None:
    """Damage a program: what was done, the new text, the right lines, the old line."""
    program = dice.choice(PROGRAMS)
    lines = program.read_bytes().decode("cp1252").split("\n")
    name = dice.choice([*DAMAGES, "a deleted end", "a deleted end"])
    if name == "a deleted end":
        end, begin = dice.choice(list(_blocks(lines).items()))
        old = lines[end - 1]
        lines[end - 1] = ""
        return f"{name} in {program.name}", "\n".join(lines), {begin}, old
    numbers = [n for n, line in enumerate(lines, 1) if line.strip() and line.strip()[0] not in ";&"]
    number = dice.choice(numbers)
    old = lines[number - 1]
    code, comment = _code(old)
    damaged = DAMAGES[name](dice, code)
    if damaged is None or damaged == code or not damaged.strip():
        return None
    lines[number - 1] = damaged + comment
    return f"{name} in {program.name}:{number}: {lines[number - 1]}", "\n".join(lines), {number}, old


def _code(line: str) -> tuple[str, str]:
    """Cut a line before its comment; a `;` within quotes is none."""
    match = re.match(r'(?:[^";]|"[^"]*")*', line)
    end = match.end() if match else len(line)
    return line[:end], line[end:]


def test_the_programs_are_sound():
    for program in PROGRAMS:
        assert not _findings(program.read_bytes().decode("cp1252")), program.name


@pytest.mark.parametrize("seed", range(5))
def test_damage_is_noticed(seed):
    dice = random.Random(seed)
    missed, total = [], 0
    while total < 500:
        found = _one(dice)
        if found is None:
            continue
        what, text, right, _ = found
        total += 1
        if not right & set(_findings(text)):
            missed.append(what)
    print(f"{total - len(missed)} of {total} noticed")
    print(*missed, sep="\n")
    assert len(missed) <= 0.05 * total
