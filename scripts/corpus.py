"""Read every robot program of many repositories and print what was understood.

Usage: ``python scripts/corpus.py PATH... [--language krl|rapid] [--list TABLE] [--opaque]``. A PATH is a git directory
(bare or with a work tree), a folder of such (each is a repository of its own), a folder of files or a zip archive.
Nothing is checked out.

Columns: program files; files that only bear a program's suffix and are left alone; files with an opaque statement, and
those of them in which more than one statement in ten is opaque; bytes; statements; opaque ones and their share; files
that do not round-trip; literals a plain regular expression finds outside comments, and those that the trees do not hold
with equal numbers.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from respot.languages.krl import syntax as krl
from respot.languages.rapid import syntax as rapid
from respot.languages.rapid.recognition import looks_like_rapid
from respot.program.statement import OPAQUE, Node, Statement
from respot.source import SourceText

Literal = tuple[str, tuple[float, ...]]


@dataclass(frozen=True)
class Language:
    """What the script must know of a language."""

    suffixes: frozenset[str]
    encodings: tuple[str, ...]
    sniff: Callable[[bytes, SourceText], bool]
    read: Callable[[str, list[int]], list[Statement]]
    no_statement: frozenset[str]
    comment: str
    literal: re.Pattern[str]
    literals: Callable[[Statement], Iterator[Literal]]


def _krl_literals(statement: Statement) -> Iterator[Literal]:
    if statement.kind not in ("declaration", "assignments"):
        return
    for node in statement.node.walk():
        if node.kind in ("variable", "assignment") and node.nodes and node.nodes[-1].kind == "aggregate":
            name = node.tokens("NAME") if node.kind == "variable" else node.nodes[0].tokens("NAME")
            yield name[0].text.upper(), tuple(_numbers(node.nodes[-1]))


#: Members of a robtarget and of a jointtarget, by how many numbers they hold.
_RAPID_LITERALS = ([3, 4, 4, 6], [6, 6])


def _rapid_literals(statement: Statement) -> Iterator[Literal]:
    if "[" not in statement.source or statement.shape.tree is None:
        return
    for node in statement.node.walk():
        if node.kind == "aggregate" and [len(member.nodes) for member in node.nodes] in _RAPID_LITERALS:
            numbers = tuple(_numbers(node))
            if len(numbers) == sum(len(member.nodes) for member in node.nodes):
                yield "", numbers


def _rapid_literal() -> re.Pattern[str]:
    """Pattern of a robtarget or jointtarget that is written in numbers, wherever it stands."""
    number = r"\s*[+-]?\s*(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*"
    members = (r"\s*,\s*".join(rf"\[{','.join([number] * count)}\]" for count in counts) for counts in _RAPID_LITERALS)
    return re.compile(rf"(?P<name>)\[\s*(?P<body>{'|'.join(members)})\s*\]")


def _numbers(node: Node) -> Iterator[float]:
    """Every number below a node with its sign, in the order of the text."""
    for child in node.nodes:
        if child.kind == "number":
            yield float(child.text)
        elif child.kind == "signed" and child.nodes[-1].kind == "number":
            sign = -1.0 if child.text[0] == "-" else 1.0
            yield sign * float(child.nodes[-1].text)
        else:
            yield from _numbers(child)


LANGUAGES = {
    "krl": Language(
        frozenset((".src", ".dat", ".sub")),
        krl.ENCODINGS,
        lambda _data, source: krl.looks_like_krl(source.text),
        krl.read_statements,
        krl.NO_STATEMENT,
        ";",
        re.compile(
            r"\bDECL\s+(?:GLOBAL\s+|CONST\s+)*(?:E6POS|E3POS|POS|FRAME|E6AXIS|E3AXIS|AXIS)\s+"
            r"(?P<name>[\w$]+)(?:\[[^\]]*\])?\s*=\s*\{(?P<body>[^{}]*)\}",
            re.IGNORECASE,
        ),
        _krl_literals,
    ),
    "rapid": Language(
        frozenset((".mod", ".modx", ".sys", ".sysx", ".prg")),
        rapid.ENCODINGS,
        lambda data, _source: looks_like_rapid(data),
        rapid.read_statements,
        rapid.NO_STATEMENT,
        "!",
        _rapid_literal(),
        _rapid_literals,
    ),
}
_NUMBER = re.compile(r"(?<![\w.])[+-]?\s*(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\w.])")
_BLANK = re.compile(r"[\s\x00\x1a\xa0\ufeff]*\Z")


@dataclass
class Counts:
    """Sums over the files of a repository."""

    files: int = 0
    other: int = 0
    touched: int = 0
    broken: int = 0
    bytes: int = 0
    statements: int = 0
    opaque: int = 0
    no_roundtrip: int = 0
    literals: int = 0
    missing: int = 0
    seconds: float = 0.0
    reasons: Counter[str] = field(default_factory=Counter)
    notes: list[str] = field(default_factory=list)
    kinds: Counter[str] = field(default_factory=Counter)

    def add(self, other: Counts) -> None:
        """Add another's sums to these."""
        for name, value in vars(other).items():
            if isinstance(value, Counter):
                getattr(self, name).update(value)
            else:
                setattr(self, name, getattr(self, name) + value)


def read_file(path: str, data: bytes, language: Language) -> Counts:
    """Read one file and count."""
    counts = Counts()
    begin = time.perf_counter()
    source = SourceText(path, data, language.encodings)
    if not language.sniff(data, source):
        counts.other = 1
        counts.notes.append(f"left alone  {path}")
        return counts
    statements = language.read(source.text, source.line_starts)
    counts.seconds = time.perf_counter() - begin
    counts.files, counts.bytes = 1, len(data)
    for statement in statements:
        counts.kinds[statement.kind] += 1
        if statement.kind in language.no_statement:
            continue
        counts.statements += 1
        if statement.kind == OPAQUE:
            counts.opaque += 1
            counts.reasons[statement.shape.reason] += 1
            counts.notes.append(
                f"opaque      {path}:{statement.line}: {statement.source[:160]}  [{statement.shape.reason}]"
            )
    counts.touched = int(counts.opaque > 0)
    if counts.opaque * 10 > counts.statements:
        counts.broken = 1
        counts.notes.append(f"broken      {path}: {counts.opaque} of {counts.statements} statements are opaque")
    problem = roundtrip(source, statements, language)
    if problem:
        counts.no_roundtrip = 1
        counts.notes.append(f"round trip  {path}: {problem}")
    _compare_literals(path, source.text, statements, language, counts)
    return counts


def roundtrip(source: SourceText, statements: list[Statement], language: Language) -> str:
    """Join statements from their tokens and all gaps, and compare the bytes; a gap may hold blanks and comments only.

    Returns what is wrong, or nothing.
    """
    pieces: list[str] = []
    position = 0
    for statement in statements:
        between = source.text[position : statement.start]
        if not _only_blanks(between, language.comment):
            return f"text before line {statement.line} belongs to no statement: {between.strip()[:60]!r}"
        pieces.append(between)
        position = statement.start
        if statement.kind != OPAQUE and statement.kind not in language.no_statement:
            for start, end in statement.tokens():
                gap = source.text[position:start]
                if not _only_blanks(gap, language.comment):
                    return f"line {statement.line} holds text that is no token: {gap!r}"
                pieces += (gap, source.text[start:end])
                position = end
            if not _only_blanks(source.text[position : statement.end], language.comment):
                return f"line {statement.line} holds text that is no token: {source.text[position : statement.end]!r}"
        pieces.append(source.text[position : statement.end])
        position = statement.end
    if not _only_blanks(source.text[position:], language.comment):
        return f"text at the end belongs to no statement: {source.text[position:].strip()[:60]!r}"
    pieces.append(source.text[position:])
    return "" if source.encode("".join(pieces)) == source.data else "the bytes differ"


def _only_blanks(text: str, comment: str) -> bool:
    if not text or text.isspace():
        return True
    return all(_BLANK.match(line.split(comment, 1)[0]) for line in re.split(r"[\r\n]+", text))


def _compare_literals(path: str, text: str, statements: list[Statement], language: Language, counts: Counts) -> None:
    held: Counter[Literal] = Counter()
    for statement in statements:
        if statement.kind != OPAQUE and statement.kind not in language.no_statement:
            held.update(language.literals(statement))
    outside = re.compile(f'"[^"\r\n]*"|{language.comment}[^\r\n]*')
    plain = outside.sub(lambda match: match.group() if match.group()[0] == '"' else "", text)
    for match in language.literal.finditer(plain):
        numbers = tuple(float(re.sub(r"\s", "", number)) for number in _NUMBER.findall(match["body"]))
        literal = (match["name"].upper(), numbers)
        counts.literals += 1
        if held[literal] > 0:
            held[literal] -= 1
        else:
            counts.missing += 1
            counts.notes.append(f"literal     {path}: {match.group()[:120]}")


def repositories(path: Path) -> Iterator[tuple[str, Path]]:
    """Name and place of each repository, archive or folder at a path."""
    if path.is_file() or _is_git(path):
        yield path.parent.name if path.name == "repo" else path.stem, path
        return
    inner = [child for child in sorted(path.glob("*/")) if _is_git(child) or _is_git(child / "repo")]
    if not inner:
        yield path.name, path
    for child in inner:
        yield child.name, child if _is_git(child) else child / "repo"


def _is_git(path: Path) -> bool:
    return (path / ".git").exists() or ((path / "HEAD").is_file() and (path / "objects").is_dir())


def files(path: Path, suffixes: frozenset[str]) -> Iterator[tuple[str, bytes]]:
    """Name and bytes of every file with one of the suffixes."""
    if path.is_file():
        with zipfile.ZipFile(path) as archive:
            for name in archive.namelist():
                if Path(name).suffix.lower() in suffixes:
                    yield name, archive.read(name)
    elif _is_git(path):
        yield from _git_files(path, suffixes)
    else:
        for file in sorted(path.rglob("*")):
            if file.is_file() and file.suffix.lower() in suffixes:
                yield file.relative_to(path).as_posix(), file.read_bytes()


def _git_files(path: Path, suffixes: frozenset[str]) -> Iterator[tuple[str, bytes]]:
    listing = subprocess.run(["git", "-C", path, "ls-tree", "-rz", "HEAD"], capture_output=True, check=True).stdout
    entries = [entry.split(b"\t", 1) for entry in listing.split(b"\0") if entry]
    wanted = [
        (head.split()[2], name.decode()) for head, name in entries if Path(name.decode()).suffix.lower() in suffixes
    ]
    with subprocess.Popen(
        ["git", "-C", path, "cat-file", "--batch"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        if process.stdin is None or process.stdout is None:
            return
        for blob, name in wanted:
            process.stdin.write(blob + b"\n")
            process.stdin.flush()
            head = process.stdout.readline().split()
            if head[1] == b"missing":
                print(f"{name} is listed but absent", file=sys.stderr)
                continue
            data = process.stdout.read(int(head[2]))
            process.stdout.read(1)
            yield name, data
        process.stdin.close()


_COLUMNS = (
    "files",
    "other",
    "touched",
    "broken",
    "bytes",
    "statements",
    "opaque",
    "no_roundtrip",
    "literals",
    "missing",
)


def _row(name: str, counts: Counts) -> str:
    share = 100 * counts.opaque / counts.statements if counts.statements else 0.0
    cells = [f"{getattr(counts, column):>{max(len(column), 9)},}" for column in _COLUMNS]
    return f"{name[:44]:44} {' '.join(cells)} {share:7.3f} %"


def main() -> int:
    """Read what the command line names; 1 if a file does not round-trip or a literal is missing."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("path", nargs="+", type=Path)
    parser.add_argument("--language", choices=sorted(LANGUAGES), default="krl")
    parser.add_argument("--list", type=Path, help="table with the columns dialect and repository: read only those")
    parser.add_argument("--opaque", action="store_true", help="print every opaque statement and every other finding")
    arguments = parser.parse_args()
    language = LANGUAGES[arguments.language]
    listed = None
    if arguments.list is not None:
        rows = [line.split("\t") for line in arguments.list.read_text(encoding="utf-8").splitlines()[1:]]
        listed = {row[1].replace("/", "+") for row in rows if row[0] == arguments.language}
    print(f"{'repository':44} {' '.join(f'{column:>9}' for column in _COLUMNS)}     share")
    total = Counts()
    for path in arguments.path:
        for name, place in repositories(path):
            if listed is not None and name not in listed:
                continue
            counts = Counts()
            for file, data in files(place, language.suffixes):
                counts.add(read_file(f"{name}/{file}", data, language))
            if counts.files or counts.other:
                print(_row(name, counts))
            total.add(counts)
    print(_row("all", total))
    print(f"{total.bytes / 1e6 / max(total.seconds, 1e-9):.1f} MB/s")
    for reason, count in total.reasons.most_common():
        print(f"{count:7}  {reason}")
    for note in total.notes:
        if arguments.opaque or not note.startswith("opaque"):
            print(note)
    return int(total.no_roundtrip > 0 or total.missing > 0)


if __name__ == "__main__":
    sys.exit(main())
