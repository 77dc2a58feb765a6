"""A reader of RAPID backups that shares nothing with respot. Statement by statement; it follows no calls."""

from __future__ import annotations

import re
from pathlib import PurePosixPath

import numpy as np

from tests.convert.independent import from_abb
from tests.convert.reading import NUMBER, Literal, Reading, Use, split_top, stripped

_FIELDS = ("x y z", "q1 q2 q3 q4", "cf1 cf4 cf6 cfx", "eax_a eax_b eax_c eax_d eax_e eax_f")
_STRING_OR_COMMENT = re.compile(r'"(?:[^"\r\n]|"")*"|![^\r\n]*')
_SIGNED = NUMBER.replace("[-+]?", r"(?:[-+]\s*)?", 1)


def _group(count: int, named: bool) -> str:
    numbers = r"\s*,\s*".join([_SIGNED] * count)
    return rf"(?:\[\s*{numbers}\s*\]{'|[^' + chr(92) + 'W' + chr(92) + 'd]' + chr(92) + 'w*' if named else ''})"


_ROBTARGET = re.compile(
    r"\[\s*" + r"\s*,\s*".join(_group(len(names.split()), index > 1) for index, names in enumerate(_FIELDS)) + r"\s*\]"
)
_DECLARED = re.compile(
    r"(?:\bLOCAL\s+)?(?:\bTASK\s+)?\b(?:CONST|PERS|VAR)\s+(\w+)\s+(\w+)\s*(?:\{([^}]*)\})?\s*:=(.*)", re.I | re.S
)
_INSTRUCTION = re.compile(
    r"\b(Move[LJC](?:DO|GO|AO|Sync)?|SpotM?[LJ]|Calib[LJ]|Arc[LC](?:Start|End|1|2)?|Trigg[LJC](?:IOs)?|Search[LC])\b",
    re.I,
)
_ROUTINE = re.compile(r"^[ \t]*(?:LOCAL[ \t]+)?PROC[ \t]+(\w+)[ \t]*\(([^)]*)\)|\bENDPROC\b", re.I | re.M)
_WOBJ = re.compile(r"\\\s*WObj\s*:=\s*(\w+)", re.I)


def masked(text: str) -> str:
    """Text with comments and strings blanked out, at the same length."""
    return _STRING_OR_COMMENT.sub(lambda found: " " * len(found[0]), text)


def read(texts: dict[str, str]) -> Reading:
    """Read decoded files by path."""
    kept = {path: text for path, text in texts.items() if PurePosixPath(path).suffix.lower() in _SUFFIXES}
    kept = {path: text for path, text in kept.items() if re.search(r"\bMODULE\b", text, re.I)}
    reading = Reading(texts=kept)
    reader = _Reader(reading, {path: masked(text) for path, text in kept.items()})
    for path in kept:
        reader.declare(path)
    for path in kept:
        reader.follow(path)
    for path in kept:
        reader.follow_calls(path)
    for found in reading.literals.values():
        found.sort(key=lambda literal: literal.span)
    return reading


_SUFFIXES = (".mod", ".sys", ".prg", ".modx", ".sysx")


class _Reader:
    def __init__(self, reading: Reading, plain: dict[str, str]) -> None:
        self.reading, self.plain = reading, plain
        self.own: dict[tuple[str, str], Literal] = {}
        self.routines: dict[str, list[tuple[int, str, list[str]]]] = {}
        #: (routine, which of its positional arguments) -> frame of the motion that goes there, or which argument it is
        self.wrapped: dict[tuple[str, int], tuple[np.ndarray | None, bool] | int] = {}
        self.everywhere: dict[str, list[Literal]] = {}
        self.frames: dict[tuple[str, str], tuple[bool, np.ndarray | None]] = {}
        self.shared_frames: dict[str, tuple[bool, np.ndarray | None]] = {}

    def declare(self, path: str) -> None:
        for found in _ROUTINE.finditer(self.plain[path]):
            words = [part.split() for part in (found[2] or "").split(",") if part.split()]
            name = (found[1] or "").lower()
            self.routines.setdefault(path, []).append((found.start(), name, [part[-1].lower() for part in words]))
        for begin, end in split_top_statements(self.plain[path]):
            found = _DECLARED.search(self.plain[path], begin, end)
            if found is None:
                continue
            kind, name = found[1].lower(), found[2].lower()
            if kind in ("wobjdata", "tooldata"):
                frame = _frame(kind, found[4])
                self.frames[path, name] = frame
                self.shared_frames.setdefault(name, frame)
                continue
            routine = self._routine(path, found.start())[0]
            matches = _ROBTARGET.finditer(self.plain[path], found.start(4), end)
            literals = [self._literal(path, name, item) for item in matches]
            sizes = [size for size in (found[3] or "").split(",") if size.strip()]
            for index, literal in enumerate(literals):
                literal = self.reading.add(literal)
                key = name
                if sizes and all(size.strip().isdigit() for size in sizes):
                    places = np.unravel_index(index, [int(size) for size in sizes])
                    key = f"{name}{{{','.join(str(place + 1) for place in places)}}}"
                elif len(literals) > 1:
                    continue
                if routine:
                    self.own[path, f"{routine}:{key}"] = literal
                    continue
                self.own[path, key] = literal
                if "LOCAL" not in found[0].upper().split(found[1].upper())[0]:
                    self.everywhere.setdefault(key, []).append(literal)

    def _literal(self, path: str, name: str, found: re.Match[str]) -> Literal:
        text = self.plain[path]
        spans: dict[str, tuple[int, int]] = {}
        inner = (found.start() + 1, found.end() - 1)
        for names, (begin, end) in zip(_FIELDS, split_top(text[: inner[1]], ",", inner[0]), strict=True):
            begin, end = stripped(text, (begin, end))
            if text[begin] == "[":
                for field, place in zip(names.split(), split_top(text[: end - 1], ",", begin + 1), strict=True):
                    spans[field] = stripped(text, place)
        texts = {field: text[slice(*place)] for field, place in spans.items()}
        line = text.count("\n", 0, found.start()) + 1
        return Literal("rapid", path, name, line, found.span(), spans, texts)

    def _routine(self, path: str, place: int) -> tuple[str, list[str]]:
        """Name and parameters of the routine that a place stands in; empty outside of any."""
        name, parameters = "", list[str]()
        for start, found, words in self.routines.get(path, []):
            if start < place:
                name, parameters = found, words
        return name, parameters

    def _find(self, name: str, path: str, routine: str = "") -> Literal | None:
        name = "".join(name.split()).lower()
        bare = name.partition(".")[0] if name not in self.everywhere else name  # a record with one target
        own = self.own.get((path, f"{routine}:{bare}")) or self.own.get((path, bare))
        name = bare
        others = self.everywhere.get(name, [])
        return own if own is not None else others[0] if len(others) == 1 else None

    def follow(self, path: str) -> None:
        """Motions of a file; what its routines do with what they are handed is noted for `follow_calls`."""
        text = self.plain[path]
        for begin, end in split_top_statements(text):
            found = _INSTRUCTION.search(text, begin, end)
            if found is None or (found.end() < end and text[found.end()] == ":"):
                continue
            routine, parameters = self._routine(path, found.start())
            wobj = _WOBJ.search(text, found.end(), end)
            positional = _positional(text, found.end(), end)
            word = found[1].lower()
            first = 2 if word.startswith("search") else 0
            count = 2 if re.match(r"(move|arc|trigg|search)c", word) else 1
            tool = text[slice(*positional[-1])].lower() if positional else ""
            name = wobj[1].lower() if wobj else "wobj0"
            base, external = self._base(name, tool, path)
            for part in positional[first : first + count]:
                handed = text[slice(*part)].strip().lower()
                if handed in parameters:
                    frame = parameters.index(name) if name in parameters else (base, external)
                    self.wrapped[routine, parameters.index(handed)] = frame
                self._operand(part, path, base, external, routine)

    def follow_calls(self, path: str) -> None:
        """Literals that are handed to a routine of the backup which goes there."""
        text = self.plain[path]
        for begin, end in split_top_statements(text):
            found = re.compile(r"\s*(\w+)(?=[\s(])").match(text, begin, end)
            if found is None or not any(name == found[1].lower() for name, _ in self.wrapped):
                continue
            positional = _positional(text, found.end(), end)
            for (name, index), frame in self.wrapped.items():
                if name == found[1].lower() and index < len(positional):
                    if isinstance(frame, int):
                        given = text[slice(*positional[frame])].lower() if frame < len(positional) else ""
                        frame = self._base(given, "", path)
                    self._operand(positional[index], path, *frame, self._routine(path, begin)[0])

    def _base(self, name: str, tool: str, path: str) -> tuple[np.ndarray | None, bool]:
        if name == "wobj0":
            return np.eye(4), False
        held, frame = self.frames.get((path, name)) or self.shared_frames.get(name) or (False, None)
        gun = self.frames.get((path, tool)) or self.shared_frames.get(tool)
        external = held and gun is not None and not gun[0]
        return (np.eye(4) if external else frame), external

    def _operand(self, span: tuple[int, int], path: str, base: np.ndarray | None, external: bool, routine: str) -> None:
        text = self.plain[path]
        begin, end = stripped(text, span)
        body = text[begin:end]
        if call := re.match(r"(Offs|RelTool)\s*\(", body, re.I):
            inner = split_top(text[: end - 1], ",\\", begin + call.end())
            if call[1].lower() == "offs" and len(inner) == 4:
                places = dict(zip("xyz", (stripped(text, part) for part in inner[1:]), strict=True))
                texts = {key: text[slice(*place)] for key, place in places.items()}
                if all(re.fullmatch(_SIGNED, value) for value in texts.values()):
                    line = text.count("\n", 0, begin) + 1
                    own = (places["x"][0], places["z"][1])
                    found = self.reading.add(Literal("rapid", path, "", line, own, places, texts, offset=True))
                    self.reading.uses.append(Use(found, path, base, external))
            self._operand(inner[0], path, base, external, routine)
            return
        literal = None
        if body.startswith("["):
            found = _ROBTARGET.match(text, begin, end)
            literal = self.reading.add(self._literal(path, "", found)) if found else None
        elif re.fullmatch(r"[\w.]+\s*(?:\{[\d,\s]+\})?", body):
            literal = self._find(body, path, routine)
        if literal is not None:
            self.reading.uses.append(Use(literal, path, base, external))
            twin = self._find(f"o_{literal.name}", path) if literal.name else None
            if twin is not None and twin.path == literal.path:
                self.reading.uses.append(Use(twin, path, base, external))


def _positional(text: str, start: int, end: int) -> list[tuple[int, int]]:
    """Spans of arguments that have no name of their own."""
    parts = split_top(text[:end], ",\\", start)
    found = [stripped(text, part) for part in parts if text[part[0] - 1] != "\\"]
    return [part for part in found if part[1] > part[0]]


def split_top_statements(text: str) -> list[tuple[int, int]]:
    """Spans of statements, without the semicolon."""
    ends = [found.start() for found in re.finditer(";", text)]
    return list(zip([0, *(end + 1 for end in ends)], [*ends, len(text)], strict=True))


def _frame(kind: str, body: str) -> tuple[bool, np.ndarray | None]:
    """Who holds a tool or work object, and the work object's frame if it is fixed by numbers alone."""
    held = body.strip().lstrip("[").strip().upper().startswith("TRUE")
    if kind == "tooldata":
        return held, None
    words = [word.strip().upper() for word in body.strip().lstrip("[").split(",")[:2]]
    numbers = [float("".join(number.split())) for number in re.findall(_SIGNED, body)]
    if words[1:] != ["TRUE"] or len(numbers) != 14:
        return held, None
    return held, from_abb(*numbers[:7]) @ from_abb(*numbers[7:])
