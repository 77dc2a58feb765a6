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
from made_up import krl_programs, krl_table, rapid_array, rapid_programs, rapid_table

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
