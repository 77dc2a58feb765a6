"""A reader of KRL backups that shares nothing with respot. Line by line; it knows no branches and follows no calls."""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass, field
from pathlib import PurePosixPath

import numpy as np

from tests.convert.reading import NUMBER, Literal, Reading, Use, split_top, stripped

_POSITIONS = "E6POS|E3POS|POS|FRAME"
_STRING_OR_COMMENT = re.compile(r'"[^"\r\n]*"|;[^\r\n]*|^&[^\r\n]*', re.M)
_MEMBER = re.compile(rf"(\w+)\s+({NUMBER})(?=\s*[,}}])")
_DECLARED = re.compile(rf"^[ \t]*((?:(?:DECL|GLOBAL|CONST)[ \t]+)*)({_POSITIONS}|FDAT)[ \t]+(.*)$", re.I | re.M)
_ELEMENT = re.compile(r"^[ \t]*(\w+[ \t]*\[[\d, \t]+\])[ \t]*=[ \t]*(\{[^{}\r\n]*\})", re.M)
_MOTION = re.compile(r"^[ \t]*(S?PTP|S?LIN|SPL|S?CIRC|S?PTP_REL|S?LIN_REL|SPL_REL|S?CIRC_REL)\b", re.I)
_END = re.compile(r"\s(?:C_\w+|WITH\b|CA\b|#\w+)", re.I)


@dataclass
class _Datum:
    literal: Literal | None
    fdat: dict[str, str] = field(default_factory=dict)


@dataclass
class _State:
    tool: int | None = None
    base: np.ndarray | None = None
    external: bool | None = None
    pending: dict[str, str] | None = None


def masked(text: str) -> str:
    """Text with comments, strings and head lines blanked out, at the same length."""
    return _STRING_OR_COMMENT.sub(lambda found: " " * len(found[0]), text)


def read(texts: dict[str, str]) -> Reading:
    """Read decoded files by path."""
    reading = Reading(texts={path: text for path, text in texts.items() if _suffix(path) in (".src", ".dat", ".sub")})
    plain = {path: masked(text) for path, text in reading.texts.items()}
    reader = _Reader(reading, plain)
    for path in plain:
        reader.declare(path)
    for path in plain:
        if _suffix(path) != ".dat":
            reader.follow(path)
    for found in reading.literals.values():
        found.sort(key=lambda literal: literal.span)
    return reading


class _Reader:
    def __init__(self, reading: Reading, plain: dict[str, str]) -> None:
        self.reading, self.plain = reading, plain
        self.own: dict[tuple[str, str], _Datum] = {}
        self.shared: dict[str, list[_Datum]] = {}
        self.types: dict[tuple[str, str], str] = {}
        self.bases: dict[int, np.ndarray] = {}
        self.whole: dict[tuple[str, str], str] = {}

    def declare(self, path: str) -> None:
        text, module = self.plain[path], _module(path)
        config = module.endswith("/$config")
        for name, number in re.findall(
            r"^[ \t]*(?:DECL[ \t]+)?INT[ \t]+(\w+)[ \t]*=[ \t]*(\d+)\s*$", text, re.I | re.M
        ):
            self.whole[module, name.upper()] = number
        for line in _DECLARED.finditer(text):
            for begin, end in split_top(text[: line.end()], ",", line.start(3)):
                item = re.match(r"\s*([\w$]+)\s*(\[[^\]]*\])?\s*(?:=\s*)?", text[begin:end])
                if item is None:
                    continue
                name = item[1].upper()
                self.types[module, name] = line[2].upper()
                value = stripped(text, (begin + item.end(), end))
                if text[value[0] : value[0] + 1] == "{":
                    shared = config or "GLOBAL" in line[1].upper()
                    self._datum(path, name, value, shared, fdat=line[2].upper() == "FDAT")
        for line in _ELEMENT.finditer(text):
            name = "".join(line[1].split()).upper()
            bare = name.partition("[")[0]
            if bare == "BASE_DATA":
                number = re.search(r"\d+", name)
                literal = self._literal(path, name, line.span(2))
                if number and literal.complete:
                    self.bases[int(number[0])] = literal.pose
            elif self.types.get((module, bare)) in _POSITIONS.split("|"):
                self._datum(path, name, line.span(2), config, fdat=False)

    def _datum(self, path: str, name: str, span: tuple[int, int], shared: bool, fdat: bool) -> None:
        text = self.plain[path][slice(*span)]
        if fdat:
            members = re.findall(r"(\w+)\s+(#?[\w.]+)", text)
            datum = _Datum(None, {key.upper(): value.upper() for key, value in members})
        else:
            literal = self._literal(path, name, span)
            datum = _Datum(self.reading.add(literal) if literal.texts.keys() & set("XYZABC") else None)
        self.own[_module(path), name] = datum
        if shared:
            self.shared.setdefault(name, []).append(datum)

    def _literal(self, path: str, name: str, span: tuple[int, int], offset: bool = False) -> Literal:
        text = self.plain[path]
        spans = {
            member[1].upper(): (span[0] + member.start(2), span[0] + member.end(2))
            for member in _MEMBER.finditer(text[slice(*span)])
        }
        line = text.count("\n", 0, span[0]) + 1
        texts = {key: text[slice(*place)] for key, place in spans.items()}
        return Literal("krl", path, name, line, span, spans, texts, offset)

    def _find(self, name: str, path: str) -> _Datum | None:
        name = "".join(name.split()).upper()
        bare, bracket, index = name.partition("[")
        places = [self.whole.get((_module(path), item), item) for item in index.rstrip("]").split(",")]
        name = bare + bracket + ",".join(places) + ("]" if bracket else "")
        own = self.own.get((_module(path), name))
        shared = self.shared.get(name, [])
        return own if own is not None else shared[0] if len(shared) == 1 else None

    # --------------------------------------------------------------------------------------------------------- motions

    def follow(self, path: str) -> None:
        state, outside, start = _State(), [], 0
        for raw in re.findall(r"[^\r\n]*(?:\r\n|\n|\r|$)", self.plain[path]):
            line = raw.rstrip("\r\n")
            upper = line.strip().upper()
            if re.match(r"(GLOBAL\s+)?DEF(FCT)?\b", upper):
                state = _State()
            elif upper.startswith("SPLINE"):
                outside.append(_State(**vars(state)))
                self._set(line, state, path)
            elif upper.startswith("ENDSPLINE") and outside:
                state = outside.pop()
            elif found := _MOTION.match(line):
                here = _State(**vars(state))
                with_list = re.search(r"\bWITH\b(.*)", line, re.I)
                if with_list:
                    self._set(with_list[1], here, path)
                self._motion(found[1].upper(), line, found.end(), start, path, here)
            else:
                self._set(line, state, path)
            start += len(raw)

    def _set(self, line: str, state: _State, path: str) -> None:
        for found in re.finditer(r"\bFDAT_ACT\s*=\s*([\w$]+)", line, re.I):
            datum = self._find(found[1], path)
            state.pending = datum.fdat if datum is not None else None
        if found := re.search(r"\bBAS\s*\(\s*(#\w+)\s*(?:,\s*([\w.]+))?", line, re.I):
            self._bas(found[1].upper(), found[2] or "", state)
        for found in re.finditer(r"(?<![\w$])\$BASE\s*=\s*([^,]+|\{[^}]*\})", line, re.I):
            expression = line[slice(*split_top(line, ",", found.start(1))[0])]
            parts = [expression[slice(*part)].strip() for part in split_top(expression, ":")]
            frames = [state.base if part.upper() == "$BASE" else self._base(part, path) for part in parts]
            known = [frame for frame in frames if frame is not None]
            state.base = functools.reduce(np.matmul, known) if len(known) == len(frames) else None
        for found in re.finditer(r"(?<![\w$])\$IPO_MODE\s*=\s*(#\w+|SIPO_MODE\((\w+)(?:\.IPO_FRAME)?\))", line, re.I):
            datum = self._find(found[2], path) if found[2] else None
            mode = datum.fdat.get("IPO_FRAME") if datum is not None else found[1].upper()
            state.external = mode == "#TCP"

    def _bas(self, command: str, argument: str, state: _State) -> None:
        if command in ("#PTP_PARAMS", "#CP_PARAMS", "#FRAMES"):
            pending = state.pending or {}
            number = pending.get("BASE_NO", "")
            state.base = self._numbered(int(number)) if number.lstrip("-").isdigit() else None
            state.external = pending.get("IPO_FRAME") == "#TCP"
        elif command == "#BASE":
            state.base = self._numbered(int(argument)) if argument.isdigit() else None
        elif command == "#INITMOV":
            state.base, state.external = np.eye(4), False
        elif command == "#EX_BASE":
            state.base = None

    def _numbered(self, number: int) -> np.ndarray | None:
        return np.eye(4) if number <= 0 else self.bases.get(number)

    def _base(self, text: str, path: str) -> np.ndarray | None:
        if text.upper() in ("$NULLFRAME", "$WORLD"):
            return np.eye(4)
        if found := re.fullmatch(r"BASE_DATA\s*\[\s*(\d+)\s*\]", text, re.I):
            return self._numbered(int(found[1]))
        if found := re.match(r"SBASE\s*\(\s*(\w+)(?:\.BASE_NO)?\s*\)", text, re.I):
            if found[1].isdigit():
                return self._numbered(int(found[1]))
            datum = self._find(found[1], path)
            number = datum.fdat.get("BASE_NO", "") if datum is not None else ""
            return self._numbered(int(number)) if number.isdigit() else None
        if re.fullmatch(r"\w+", text) and (datum := self._find(text, path)) is not None:
            return datum.literal.pose if datum.literal is not None and datum.literal.complete else None
        if found := re.fullmatch(r"\{[^{}]*\}", text):
            numbers = dict(re.findall(rf"([XYZABC])\s+({NUMBER})", found[0].upper()))
            if set(numbers) >= set("XYZABC"):
                literal = Literal("krl", path, "", 0, (0, 0), {}, numbers)
                return literal.pose
        return None

    def _motion(self, word: str, line: str, begin: int, start: int, path: str, state: _State) -> None:
        rest = line[begin:]
        body = rest
        depth = 0
        for place in range(len(rest)):  # the operands end where options begin, outside of brackets
            depth += (rest[place] in "([{") - (rest[place] in ")]}")
            if depth == 0 and _END.match(rest, place):
                body = rest[:place]
                break
        relative = word.endswith("_REL")
        if relative and ("#TOOL" in rest.upper()):
            return
        for first, last in split_top(body, ",")[: 2 if "CIRC" in word else 1]:
            span = stripped(body, (first, last))
            self._operand(body[slice(*span)], start + begin + span[0], relative, path, state)

    def _operand(self, text: str, place: int, relative: bool, path: str, state: _State) -> None:
        while text.startswith("(") and text.endswith(")"):
            text, place = text[1:-1], place + 1
        first = split_top(text, ":")[0]
        while text[first[0] : first[0] + 1] == "(":  # (P:F):F
            inner = text[first[0] + 1 : text.rindex(")", *first)]
            text, place, first = inner, place + first[0] + 1, split_top(inner, ":")[0]
        begin, end = stripped(text, first)
        operand = text[begin:end]
        literal = None
        if operand.startswith("{"):
            span = (place + begin, place + end)
            found = self._literal(path, "", span, relative)
            if found.texts.keys() & set("XYZABC"):
                literal = self.reading.add(found)
        elif not relative and re.fullmatch(r"\w+(\s*\[[\w,\s]+\])?", operand):
            datum = self._find(operand, path)
            literal = datum.literal if datum is not None else None
        if literal is not None:
            external = bool(state.external)
            base = np.eye(4) if external else state.base
            self.reading.uses.append(Use(literal, path, base, external))


def _suffix(path: str) -> str:
    return PurePosixPath(path).suffix.lower()


def _module(path: str) -> str:
    return str(PurePosixPath(path).with_suffix("")).lower()
