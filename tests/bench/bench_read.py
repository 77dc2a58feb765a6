"""How fast programs are read, against the plain grammar, in one run.

Usage: ``python tests/bench/bench_read.py [--megabytes 5] [--repeat 3] [--memory] [--peers PYTHON] [--antlr DIR]
[--corpus PATH...]``

Both sides turn bytes into statements and read every number of every member of every aggregate, as a number with its place;
what they find is compared; peers only parse. The baseline is our own grammar on the whole file: Lark, LALR, contextual lexer, Python's
default garbage collector. ``--corpus`` takes what `scripts/corpus.py` takes; without it the mixed programs are made up.
"""

from __future__ import annotations

import argparse
import importlib
import json
import random
import re
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from lark import Lark, Token, Tree
from lark.exceptions import LarkError

from respot.languages.krl import syntax as krl
from respot.languages.rapid import syntax as rapid
from respot.languages.rapid.recognition import looks_like_rapid
from respot.languages.shapes import Shapes
from respot.program.statement import OPAQUE, Statement, number
from respot.resources import resource
from respot.source import SourceText, Span

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))

#: A number of a target and its place.
Field = tuple[float, Span]
Fields = list[Field]


@dataclass(frozen=True)
class Language:
    """What the benchmark needs of a language."""

    shapes: Shapes
    encodings: tuple[str, ...]
    read: Callable[[str, list[int]], list[Statement]]
    kinds: frozenset[str]


LANGUAGES = {
    "krl": Language(
        krl.SHAPES, krl.ENCODINGS, krl.read_statements, frozenset(("declaration", "assignments", "motion"))
    ),
    "rapid": Language(rapid.SHAPES, rapid.ENCODINGS, rapid.read_statements, frozenset(("data", "call"))),
}


# ours


def ours(data: bytes, language: Language) -> Iterator[Fields]:
    """Numbers of each statement that holds an aggregate."""
    source = SourceText("", data, language.encodings)
    for statement in language.read(source.text, source.line_starts):
        if statement.kind in language.kinds:
            numbers = statement.numbers()
            if numbers.spans:
                yield list(zip(numbers.values, numbers.spans, strict=True))


# baseline


def baseline(data: bytes, language: Language, lark: Lark) -> Iterator[Fields]:
    """Return the same from the tree of the whole file."""
    source = SourceText("", data, language.encodings)
    for statement in lark.parse(source.text).children:
        if isinstance(statement, Tree) and statement.data in language.kinds:
            fields: Fields = []
            _collect(statement, fields)
            if fields:
                yield fields


def _collect(tree: Tree[Token], fields: Fields) -> None:
    for child in tree.children:
        if not isinstance(child, Tree):
            continue
        tokens = _literal(child)
        if tokens is None:
            _collect(child, fields)
        else:
            sign = -1.0 if sum(token == "-" for token in tokens) % 2 else 1.0
            fields.append((sign * number(tokens[-1]), (tokens[0].start_pos or 0, tokens[-1].end_pos or 0)))


def _literal(tree: Tree[Token]) -> list[Token] | None:
    """Return the signs and the number of a literal, None for anything else."""
    if tree.data == "number":
        return [child for child in tree.children if isinstance(child, Token)]
    if tree.data == "signed":
        sign, operand = tree.children
        below = _literal(operand) if isinstance(operand, Tree) else None
        if isinstance(sign, Token) and below is not None:
            return [sign, *below]
    return None


# input


def krl_table(size: int, seed: int = 1) -> bytes:
    """Return a data list as a pendant writes it: points, FDAT and PDAT lines, comments."""
    dice = random.Random(seed)
    lines = ["&ACCESS RVP", "&REL 12", "DEFDAT  SPOTS PUBLIC", ";FOLD EXTERNAL DECLARATIONS;%{PE}%MKUKATPBASIS"]
    total, number = 0, 0
    while total < size:
        number += 1
        xyz = ",".join(f"{axis} {dice.uniform(-2500, 2500):.6g}" for axis in "XYZ")
        abc = ",".join(f"{axis} {dice.uniform(-180, 180):.6g}" for axis in "ABC")
        external = ",".join(f"E{i} 0.0" for i in range(1, 7))
        base = dice.randrange(1, 9)
        new = [
            f"DECL E6POS XP{number}={{{xyz},{abc},S {dice.choice((2, 6, 22))},T {dice.randrange(64)},{external}}}",
            f'DECL FDAT FP{number}={{TOOL_NO {dice.randrange(1, 16)},BASE_NO {base},IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}}',
            f"DECL PDAT PPDAT{number}={{VEL {dice.randrange(10, 101)}.000,ACC 100.000,APO_DIST 100.000,APO_MODE #CDIS}}",
        ]
        if number % 10 == 0:
            new.append(f"; station {number}")
        lines += new
        total += sum(map(len, new)) + 2 * len(new)
    return "\r\n".join([*lines, ";ENDFOLD", "ENDDAT", ""]).encode("cp1252")


def rapid_table(size: int, seed: int = 1) -> bytes:
    """Return a module of robtargets."""
    dice = random.Random(seed)
    lines, total, number = ["MODULE Spots"], 0, 0
    while total < size:
        number += 1
        xyz = ",".join(f"{dice.uniform(-2500, 2500):.7g}" for _ in range(3))
        quaternion = ",".join(f"{dice.uniform(-1, 1):.9g}" for _ in range(4))
        configuration = f"{dice.randrange(-2, 2)},{dice.randrange(-2, 2)},{dice.randrange(-2, 2)},0"
        line = f"  CONST robtarget p{number}:=[[{xyz}],[{quaternion}],[{configuration}],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];"
        lines.append(line)
        total += len(line) + 2
    return "\r\n".join([*lines, "ENDMODULE", ""]).encode("latin-1")


def krl_programs(size: int, seed: int = 1) -> list[bytes]:
    """Return programs with inline forms, logic and calls; about one new shape of statement in a hundred lines."""
    dice = random.Random(seed)
    programs: list[bytes] = []
    total = 0
    while total < size:
        programs.append(_program(dice, len(programs)))
        total += len(programs[-1])
    return programs


def _program(dice: random.Random, index: int) -> bytes:
    lines = [
        "&ACCESS RVP",
        f"&REL {dice.randrange(1, 400)}",
        f"DEF STYLE{index} ( )",
        "DECL INT COUNT, STATE",
        "BOOL DONE",
    ]
    for _ in range(dice.randrange(20, 120)):
        lines += dice.choice((_form, _form, _condition, _assignment, _trigger, _wait, _loop))(dice)
    return "\r\n".join([*lines, "END", ""]).encode("cp1252")


def _term(dice: random.Random, depth: int = 0) -> str:
    choice = dice.randrange(9 if depth < 2 else 5)
    if choice == 0:
        return str(dice.randrange(100))
    if choice == 1:
        return f"{dice.uniform(-50, 50):.3f}"
    if choice < 4:
        return dice.choice(("COUNT", "STATE", "$VEL.CP", "OFFSET", "$POS_ACT.X", f"TABLE[{dice.randrange(9)}]"))
    if choice == 4:
        return f"$IN[{dice.randrange(1, 1024)}]"
    if choice == 5:
        return f"ABS({_term(dice, depth + 1)})"
    if choice == 6:
        return f"({_term(dice, depth + 1)}{dice.choice('+-*/')}{_term(dice, depth + 1)})"
    return f"{_term(dice, depth + 1)} {dice.choice('+-*/')} {_term(dice, depth + 1)}"


def _test(dice: random.Random) -> str:
    comparison = ("==", "<>", ">", "<=")
    tests = [f"({_term(dice, 1)}{dice.choice(comparison)}{_term(dice, 1)})" for _ in range(dice.randrange(1, 3))]
    return dice.choice((" AND ", " OR ")).join(tests)


#: Programs of a plant say the same again with other names and numbers: 142,000 public lines have 1,700 shapes.
_POOL_DICE = random.Random(7)
_TERMS = [_term(_POOL_DICE) for _ in range(700)]
_TESTS = [_test(_POOL_DICE) for _ in range(700)]
_WORD = re.compile(r"\b(?:COUNT|STATE|OFFSET|TABLE|[0-9]+)\b")


def _again(dice: random.Random, pool: list[str]) -> str:
    """Return an expression of the pool with other names and numbers."""

    def other(match: re.Match[str]) -> str:
        return str(dice.randrange(1000)) if match[0].isdigit() else f"{match[0]}_{dice.choice('ABCDEFGHJK')}"

    return _WORD.sub(other, dice.choice(pool))


def _rapid_target(dice: random.Random) -> str:
    numbers = [[f"{dice.uniform(-2000, 2000):.6g}" for _ in range(3)], [f"{dice.uniform(-1, 1):.9g}" for _ in range(4)]]
    numbers += [
        [str(dice.randrange(-2, 2)) for _ in range(3)] + ["0"],
        ["9E+09", f"{dice.uniform(0, 200):.5g}", *["9E9"] * 4],
    ]
    return f"[{','.join(f'[{chr(44).join(group)}]' for group in numbers)}]"


def rapid_array(size: int, seed: int = 3) -> bytes:
    """Return a module with one array of robtargets, a row a line."""
    dice = random.Random(seed)
    rows: list[str] = []
    total = 0
    while total < size:
        rows.append(_rapid_target(dice))
        total += len(rows[-1]) + 5
    table = f"  PERS robtarget targets{{{len(rows)}}}:=["
    return "\r\n".join(["MODULE Table", table, ",\r\n  ".join(rows), "];", "ENDMODULE", ""]).encode("latin-1")


def rapid_programs(size: int, seed: int = 4) -> list[bytes]:
    """Return programs with inline targets, spot welding, logic and calls."""
    dice = random.Random(seed)
    programs: list[bytes] = []
    total = 0
    while total < size:
        lines = ["%%%", "  VERSION:1", "  LANGUAGE:ENGLISH", "%%%", "", f"MODULE Style{len(programs)}"]
        points = range(dice.randrange(5, 30))
        lines += [f"  CONST robtarget p{index}0:={_rapid_target(dice)};" for index in points]
        for index in range(dice.randrange(3, 9)):
            lines += ["", f"  PROC rPart{index}(num count\\switch fast)"]
            for _ in range(dice.randrange(10, 50)):
                lines += dice.choice((_rapid_move, _rapid_move, _rapid_spot, _rapid_block, _rapid_logic))(dice)
            lines += ["  ERROR", "    IF ERRNO=ERR_WAIT_MAXTIME RETRY;", "    RAISE;", "  ENDPROC"]
        programs.append("\r\n".join([*lines, "ENDMODULE", ""]).encode("latin-1"))
        total += len(programs[-1])
    return programs


def _rapid_move(dice: random.Random) -> list[str]:
    target = dice.choice(
        (f"p{dice.randrange(300)}", _rapid_target(dice), f"Offs(p{dice.randrange(99)},0,0,{dice.randrange(99)})")
    )
    option = dice.choice(("", f"\\ID:={dice.randrange(99)}"))
    wobj = dice.choice(("", f"\\WObj:=wobj{dice.randrange(9)}"))
    return [
        f"    Move{dice.choice('LJ')} {target}{option},v{dice.randrange(9)}00,z{dice.randrange(9)}0,tGun{dice.randrange(4)}{wobj};"
    ]


def _rapid_spot(dice: random.Random) -> list[str]:
    name = f"wp{dice.randrange(30000, 40000)}"
    option = dice.choice(("", "\\QuickRelease", ",\\InPos\\NoConc"))
    return [f"    !{name}", f"    SpotL {name},vmax,gun{dice.randrange(4)},Sd_{name}_20{option},tGun\\WObj:=wPart;"]


#: 98,000 public statements of RAPID have 2,800 shapes.
_RAPID_POOLS = (_TERMS[:150], _TESTS[:100])


def _rapid_expression(dice: random.Random) -> str:
    other = str.maketrans({"$": "n", "[": "{", "]": "}"})
    text = _again(dice, dice.choice(_RAPID_POOLS)).translate(other)
    return text.replace("==", "=").replace("nIN{", "inputs{")


def _rapid_logic(dice: random.Random) -> list[str]:
    names = ("count", "state", "offset.x", "table{3}")
    return [
        f"    {dice.choice(names)}:={_rapid_expression(dice)}; ! set",
        f"    IF {_rapid_expression(dice)} GOTO again;",
        f"    WaitDI di{dice.randrange(99)},{dice.randrange(2)}\\MaxTime:=0.{dice.randrange(1, 9)};",
        f'    TPWrite "station "\\Num:={dice.randrange(99)};',
    ]


def _rapid_block(dice: random.Random) -> list[str]:
    return [
        f"    IF {_rapid_expression(dice)} THEN",
        f"      rPart{dice.randrange(9)} {dice.randrange(9)}\\fast;",
        "    ENDIF",
    ]


def _form(dice: random.Random) -> list[str]:
    point, tool, base = dice.randrange(1, 300), dice.randrange(1, 16), dice.randrange(1, 32)
    kind, speed = dice.choice((("PTP", "100 %"), ("LIN", "0.5 m/s")))
    letter, group = ("P", "PTP_PARAMS,100") if kind == "PTP" else ("L", "CP_PARAMS,0.5")
    blend = dice.choice(("", " C_DIS", " C_DIS C_DIS"))
    return [
        f";FOLD {kind} P{point} Vel={speed} {letter}DAT{point} Tool[{tool}] Base[{base}];%{{PE}}%R 8.3.22,%MKUKATPBASIS,%CMOVE,%V{kind}",
        "$BWDSTART=FALSE",
        f"{letter}DAT_ACT={letter}{letter}DAT{point}",
        f"FDAT_ACT=FP{point}",
        f"BAS(#{group})",
        f"{kind} XP{point}{blend}",
        ";ENDFOLD",
    ]


def _condition(dice: random.Random) -> list[str]:
    return [f"IF {_again(dice, _TESTS)} THEN", *(f"  {line}" for line in _assignment(dice)), "ENDIF"]


def _assignment(dice: random.Random) -> list[str]:
    return [f"{dice.choice(('COUNT', 'STATE', 'OFFSET', '$OUT[12]', 'TABLE[3].X'))} = {_again(dice, _TERMS)} ; set"]


def _trigger(dice: random.Random) -> list[str]:
    delay = dice.randrange(-99, 99)
    return [f"TRIGGER WHEN DISTANCE={dice.randrange(2)} DELAY={delay} DO GUN({dice.randrange(9)},TRUE) PRIO=-1"]


def _wait(dice: random.Random) -> list[str]:
    return [f"WAIT FOR {_again(dice, _TESTS)}", f"WAIT SEC 0.{dice.randrange(1, 9)}"]


def _loop(dice: random.Random) -> list[str]:
    target = f"{{X {dice.uniform(-9, 9):.1f},Y {dice.uniform(-9, 9):.2f},Z 0,A 0,B 90,C 0}}"
    return [
        f"FOR COUNT=1 TO {dice.randrange(2, 50)}",
        f"  LIN_REL {target} C_DIS",
        f"  CALL{dice.randrange(9)}(COUNT,,#FAST)",
        "ENDFOR",
    ]


# one case


def measure(name: str, files: list[bytes], language: Language, repeat: int) -> float:
    """Print one line of the table and return the ratio."""
    lark = Lark(
        resource("grammars", f"{language.shapes._grammar}.lark").read_text(encoding="utf-8"),
        parser="lalr",
        start="file",
    )
    _ = language.shapes.kinds("x")  # builds the grammar: its price is not that of reading
    begin = time.process_time()
    expected: list[list[Fields]] = []
    readable: list[bytes] = []
    failed = 0.0
    for data in files:
        start = time.process_time()
        try:
            expected.append(list(baseline(data, language, lark)))
            readable.append(data)
        except LarkError:
            failed += time.process_time() - start
    slow = time.process_time() - begin - failed
    best = float("inf")
    for _ in range(repeat):
        _forget(language)
        begin = time.process_time()
        for data in readable:
            for _fields in ours(data, language):
                pass
        best = min(best, time.process_time() - begin)
    different = sum(list(ours(data, language)) != fields for data, fields in zip(readable, expected, strict=True))
    size = sum(map(len, readable)) / 1e6
    share = f"{len(readable)}/{len(files)}"
    print(
        f"{name:24} {size:7.2f} {share:>9} {size / slow:9.2f} {size / best:9.2f} {slow / best:7.1f}x {different:9}",
        flush=True,
    )
    return slow / best


def _forget(language: Language) -> None:
    """Empty every cache, so that each shape is parsed within the measured time."""
    shapes = language.shapes
    shapes._units.clear()
    shapes._parts.clear()
    shapes._kinds.clear()
    (krl if shapes is krl.SHAPES else rapid)._LINES.clear()


def memory(name: str, data: bytes, language: Language) -> None:
    """Print the peak of traced memory while a file is read, as a multiple of its size."""
    _forget(language)
    list(ours(b"", language))
    tracemalloc.start()
    source = SourceText("", data, language.encodings)
    statements = language.read(source.text, source.line_starts)
    held = tracemalloc.get_traced_memory()[0]
    for statement in statements:
        if statement.kind in language.kinds:
            _ = statement.numbers().values
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    print(f"{name:24} statements {held / len(data):5.1f}x the file, peak {peak / len(data):5.1f}x")


#: Other readers in Python: name -> language and what to run, which prints seconds and files read in full.
PEERS = {
    "krllint": (
        "krl",
        """
import contextlib, io, json, sys, time
from krllint.linter import Linter
paths, sys.argv = sys.argv[1:], ["krllint", "."]
linter, read, begin = Linter(), 0, time.process_time()
for path in paths:
    with contextlib.suppress(Exception), contextlib.redirect_stdout(io.StringIO()):
        linter._lint_file(path)
        read += 1
print(json.dumps([time.process_time() - begin, read]))
""",
    ),
    "rapidchecker": (
        "rapid",
        """
import contextlib, json, sys, time
from rapidchecker.check import check_format
read, begin = 0, time.process_time()
for path in sys.argv[1:]:
    with contextlib.suppress(Exception):
        text = open(path, encoding="latin-1").read()
        read += not check_format(text)
print(json.dumps([time.process_time() - begin, read]))
""",
    ),
    "ANTLR": (
        "krl",
        """
import contextlib, importlib, json, pathlib, sys, time
folder = pathlib.Path(sys.argv[1])
sys.path.insert(0, str(folder))
from antlr4 import CommonTokenStream, InputStream
from antlr4.error.ErrorListener import ErrorListener
class Errors(ErrorListener):
    count = 0
    def syntaxError(self, *_):
        self.count += 1
def made(suffix):
    name, = (path.stem for path in folder.glob("*" + suffix + ".py"))
    return getattr(importlib.import_module(name), name)
Lexer, Parser = made("Lexer"), made("Parser")
read, begin = 0, time.process_time()
for path in sys.argv[2:]:
    errors = Errors()
    lexer = Lexer(InputStream(pathlib.Path(path).read_bytes().removeprefix(b"\\xef\\xbb\\xbf").decode("cp1252", "replace")))
    parser = Parser(CommonTokenStream(lexer))
    for part in (lexer, parser):
        part.removeErrorListeners()
        part.addErrorListener(errors)
    with contextlib.suppress(Exception):
        getattr(parser, Parser.ruleNames[0])()
        read += not errors.count
print(json.dumps([time.process_time() - begin, read]))
""",
    ),
}
#: How many files at most, and for how long.
_PEER_LIMITS = {"krllint": (30, 100), "rapidchecker": (30, 100), "ANTLR": (1000, 400)}


def peers(commands: dict[str, list[str]], name: str, files: list[bytes], language: str) -> None:
    """Print how fast other readers, and then ours, are on a part of the same input, and how many files they can read."""
    for peer, command in commands.items():
        if PEERS[peer][0] != language:
            continue
        most, patience = _PEER_LIMITS[peer]
        part = files[:: -(-len(files) // most)]
        size = sum(map(len, part)) / 1e6
        with tempfile.TemporaryDirectory() as folder:
            paths = []
            for index, data in enumerate(part):
                path = Path(folder) / f"a{index}{'.src' if language == 'krl' else '.mod'}"
                path.write_bytes(data)
                paths.append(str(path))
            try:
                done = subprocess.run([*command, *paths], capture_output=True, timeout=patience, check=True)
                seconds, read = json.loads(done.stdout)
                print(f"{name:24} {peer}: {size:.2f} MB, {size / seconds:.3f} MB/s, {read} of {len(part)} files read")
            except subprocess.TimeoutExpired:
                print(f"{name:24} {peer}: not done after {patience} s with {size:.2f} MB")
            except subprocess.CalledProcessError as error:
                reason = error.stderr.decode(errors="replace").splitlines()
                print(f"{name:24} {peer}: does not run ({reason[-1] if reason else error.returncode})")
                continue
        _forget(LANGUAGES[language])
        begin, read = time.process_time(), 0
        for data in part:
            read += not _opaque(data, LANGUAGES[language])
        seconds = time.process_time() - begin
        print(f"{name:24} ours on the same: {size / seconds:.3f} MB/s, {read} of {len(part)} files read", flush=True)


def _opaque(data: bytes, language: Language) -> bool:
    """Read a file as `ours` does and tell whether there is a statement that was not understood."""
    source = SourceText("", data, language.encodings)
    opaque = False
    for statement in language.read(source.text, source.line_starts):
        opaque = opaque or statement.kind == OPAQUE
        if statement.kind in language.kinds:
            numbers = statement.numbers()
            _ = list(zip(numbers.values, numbers.spans, strict=True))
    return opaque


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--megabytes", type=float, default=5.0)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--memory", action="store_true")
    parser.add_argument("--language", choices=sorted(LANGUAGES), action="append")
    parser.add_argument("--corpus", type=Path, nargs="+", default=[], help="repositories of real programs")
    parser.add_argument("--peers", metavar="PYTHON", help="a Python that has krllint and rapidchecker: run them too")
    parser.add_argument("--antlr", metavar="DIR", help="a KRL parser that ANTLR generated for Python 3: run it too")
    arguments = parser.parse_args()
    size = int(arguments.megabytes * 1e6)
    cases: list[tuple[str, str, list[bytes]]] = [
        ("KRL point table", "krl", [krl_table(size)]),
        ("KRL programs, made up", "krl", krl_programs(size)),
        ("RAPID point table", "rapid", [rapid_table(size)]),
        ("RAPID array of points", "rapid", [rapid_array(size // 2)]),
        ("RAPID programs, made up", "rapid", rapid_programs(size)),
    ]
    if arguments.corpus:
        corpus = importlib.import_module("corpus")  # a script beside the package

        for language, recognised in (("krl", _is_krl), ("rapid", looks_like_rapid)):
            found = [
                data
                for path in arguments.corpus
                for _, place in corpus.repositories(path)
                for _, data in corpus.files(place, corpus.LANGUAGES[language].suffixes)
            ]
            programs = [data for data in found if recognised(data)]
            if programs:
                cases.append((f"{language.upper()} programs, corpus", language, programs))
    cases = [case for case in cases if not arguments.language or case[1] in arguments.language]
    print(f"{'':24} {'MB':>7} {'files':>9} {'Lark MB/s':>9} {'ours MB/s':>9} {'ratio':>8} {'different':>9}")
    for name, language, files in cases:
        measure(name, files, LANGUAGES[language], arguments.repeat)
    commands = {}
    if arguments.peers:
        commands = {peer: [arguments.peers, "-c", PEERS[peer][1]] for peer in ("krllint", "rapidchecker")}
    if arguments.antlr:
        commands["ANTLR"] = [sys.executable, "-c", PEERS["ANTLR"][1], arguments.antlr]
    if commands:
        small = [
            ("KRL point table", "krl", [krl_table(100_000)]),
            ("KRL programs, made up", "krl", krl_programs(200_000)),
            ("RAPID point table", "rapid", [rapid_table(20_000)]),
            ("RAPID programs, made up", "rapid", rapid_programs(60_000)),
            *(case for case in cases if case[0].endswith("corpus")),
        ]
        for name, language, files in small:
            if not arguments.language or language in arguments.language:
                peers(commands, name, files, language)
    if arguments.memory:
        for name, language, files in cases:
            if len(files) == 1:
                memory(name, files[0], LANGUAGES[language])


def _is_krl(data: bytes) -> bool:
    return krl.looks_like_krl(SourceText("", data, krl.ENCODINGS).text)


if __name__ == "__main__":
    main()
