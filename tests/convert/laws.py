"""What must hold of every conversion by a known transform, judged by the independent readers.

Each Cartesian literal that moves is the transform of the old one to half its last printed digit, its offsets turn,
everything else is byte-identical; and converted back every number is what it was within its last printed digit.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.convert import read_krl, read_rapid
from tests.convert.independent import abc_of, angle_between, quaternion_of
from tests.convert.reading import CONFIGURATION, ORIENTATION, POSITION, Literal, Reading, Use

HEADER = re.compile(r"[ \t]*[;!]respot: [^\r\n]*(?:\r*\n|\r|$)")
SUFFIXES = (".src", ".dat", ".sub", ".mod", ".sys", ".prg", ".modx", ".sysx")
READERS = {"krl": read_krl.read, "rapid": read_rapid.read}
#: Beyond this cosine of B digits of A and C count for the pose only, not each for itself.
LOCK_COSINE = 5e-3


@dataclass
class Findings:
    """What was judged, and what was wrong."""

    moved: int = 0
    offsets: int = 0
    unseen: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    restored: int = 0


def files_of(root: Path) -> dict[str, bytes]:
    """Files of a folder by path, without our record."""
    found = sorted(path for path in root.rglob("*") if path.is_file())
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in found if path.name != "respot.json"}


def decoded(files: Mapping[str, bytes]) -> dict[str, str]:
    """Text of files, one character a byte; lines of our header are taken out."""
    return {path: HEADER.sub("", data.decode("latin-1")) for path, data in files.items()}


def language_of(paths: Iterable[str]) -> str:
    suffixes = {Path(path).suffix.lower() for path in paths}
    return "krl" if suffixes & {".src", ".dat"} else "rapid"


def live(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Files that a controller runs: of an ABB backup those of its tasks, if it has such, without copies under HOME."""
    tasks = {path: data for path, data in files.items() if re.search(r"(^|/)RAPID/TASK\d+/", path, re.IGNORECASE)}
    return tasks or dict(files)


def read(files: Mapping[str, bytes]) -> Reading:
    return READERS[language_of(files)](decoded(live(files)))


def in_base(base: np.ndarray, transform: np.ndarray) -> np.ndarray:
    return np.linalg.inv(base) @ transform @ base


def decimals(text: str) -> int:
    mantissa, _, exponent = "".join(text.split()).lower().partition("e")
    return len(mantissa.partition(".")[2]) - int(exponent or 0)


def half_digit(text: str) -> float:
    return 0.5 * 10.0 ** -decimals(text) * 1.001 + 1e-11


# --------------------------------------------------------------------------------------------------------------- moved


def judge(old: Mapping[str, bytes], new: Mapping[str, bytes], transform: np.ndarray, record: Mapping) -> Findings:
    """Judge a conversion.

    Parameters
    ----------
    old, new :
        Files before and after.
    transform : (4, 4) array
        source2reference.
    record :
        What ``convert --json`` said.
    """
    found = Findings()
    edited = {edit["path"] for edit in record["edits"]}
    if set(old) != set(new):
        found.wrong.append(f"other files: {sorted(set(old) ^ set(new))[:3]}")
        return found
    found.wrong += [f"{path}: not byte-identical" for path in old if path not in edited and old[path] != new[path]]
    before, after = read(old), read(new)
    uses: dict[tuple[str, tuple[int, int]], list[Use]] = {}
    for use in before.uses:
        uses.setdefault((use.literal.path, use.literal.span), []).append(use)
    changed: set[tuple[str, int]] = set()
    for path in sorted(edited):
        pairs = list(_pairs(path, before, after, found))
        _judge_rest(path, before, after, pairs, found)
        for was, now in pairs:
            if was.texts != now.texts:
                changed.add((path, was.line))
                _judge_literal(was, now, uses.get((path, was.span), []), transform, found)
    claimed = {(edit["path"], edit["line"]) for edit in record["edits"]}
    # an edit in a literal that spans lines is named by its first
    found.wrong += [f"{path}:{line}: claimed and not seen" for path, line in sorted(claimed - changed)]
    found.wrong += [f"{path}:{line}: seen and not claimed" for path, line in sorted(changed - claimed)]
    _judge_left_behind(before, after, uses, transform, record, found)
    return found


def _pairs(path: str, before: Reading, after: Reading, found: Findings) -> Iterable[tuple[Literal, Literal]]:
    first, second = before.literals.get(path, []), after.literals.get(path, [])
    if len(first) != len(second):
        found.wrong.append(f"{path}: {len(second)} literals where there were {len(first)}")
        return []
    return zip(first, second, strict=True)


def _judge_rest(
    path: str, before: Reading, after: Reading, pairs: list[tuple[Literal, Literal]], found: Findings
) -> None:
    """Outside of the numbers of literals every byte is what it was; a relative motion may get components it lacked."""
    texts = []
    for reading, side in ((before, 0), (after, 1)):
        text, cuts = reading.texts[path], []
        for pair in pairs:
            literal, other = pair[side], pair[1 - side]
            for name, (start, end) in literal.spans.items():
                added = name not in other.spans
                cuts.append((text.rindex(",", literal.span[0], start) if added else start, end))
        place, kept = 0, []
        for start, end in sorted(cuts):
            kept.append(text[place:start])
            place = end
        texts.append("".join([*kept, text[place:]]))
    if texts[0] != texts[1]:
        at = next((i for i, (a, b) in enumerate(zip(*texts, strict=False)) if a != b), min(map(len, texts)))
        found.wrong.append(f"{path}: differs outside of numbers: {texts[0][at - 30 : at + 30]!r}")


def _judge_literal(was: Literal, now: Literal, uses: list[Use], transform: np.ndarray, found: Findings) -> None:
    place = f"{was.path}:{was.line} {was.name}"
    bases = [use.base for use in uses if use.base is not None]
    if not bases:
        found.unseen.append(place)
        return
    for base in bases:
        seen = in_base(base, transform)
        problem = _offset(was, now, seen) if was.offset else _pose(was, now, seen)
        if problem:
            found.wrong.append(f"{place}: {problem}")
            return
    if was.offset:
        found.offsets += 1
    else:
        found.moved += 1


def _offset(was: Literal, now: Literal, seen: np.ndarray) -> str:
    names = "XYZ" if was.language == "krl" else "xyz"
    wanted = seen[:3, :3] @ was.values(names)
    for name, value in zip(names, wanted, strict=True):
        half = half_digit(now.texts[name]) if name in now.texts else 0.51e-3
        if abs(float("".join(now.texts.get(name, "0").split())) - value) > half:
            return f"offset {name} is {now.texts.get(name)}, not {value:.6f}"
    return ""


def _pose(was: Literal, now: Literal, seen: np.ndarray) -> str:
    language = was.language
    position, orientation, configuration = POSITION[language], ORIENTATION[language], CONFIGURATION[language]
    wanted = seen @ was.pose
    for name, value in zip(position, wanted[:3, 3], strict=True):
        if abs(float("".join(now.texts[name].split())) - value) > half_digit(now.texts[name]):
            return f"{name} is {now.texts[name]}, not {value:.6f}"
    halves = np.array([half_digit(now.texts[name]) for name in orientation])
    printed, old = now.values(orientation), was.values(orientation)
    if language == "krl":
        numbers = abc_of(wanted[:3, :3], near=old)
        if np.cos(np.radians(wanted_b := numbers[1])) ** 2 < LOCK_COSINE**2:
            turn = angle_between(now.pose, wanted)
            if turn > np.linalg.norm([halves[0] + halves[2], halves[1]]) + 1e-6:
                return f"turned by {turn:.7f} degrees from what it should be (B is {wanted_b:.4f})"
            numbers = printed
        if (np.abs(old) <= 180.0).all() and (np.abs(printed) > 180.0).any():
            return f"A, B, C beyond 180 degrees: {printed}"
    else:
        numbers = quaternion_of(wanted[:3, :3], near=old)
    away = np.abs(printed - numbers)
    if (away > halves + 1e-9).any():
        return f"{orientation} are {printed}, not {numbers}"
    for name, text in now.texts.items():
        if name in configuration:
            if was.texts[name] != text and not re.fullmatch(r"-?\d+|'[BbHh]?[0-9A-Fa-f]+'", text):
                return f"{name} is {text}"
        elif name not in (*position, *orientation) and was.texts[name] != text:
            return f"{name} was {was.texts[name]} and is {text}"
    least = (3, 4 if language == "krl" else 7)
    for name in (*position, *orientation):
        if was.texts[name] != now.texts[name]:
            wanted_decimals = max(decimals(was.texts[name]), least[name in orientation])
            if decimals(now.texts[name]) < min(wanted_decimals, 12):
                return f"{name} {was.texts[name]} became {now.texts[name]}: digits are lost"
    return ""


def _judge_left_behind(
    before: Reading,
    after: Reading,
    uses: Mapping[tuple[str, tuple[int, int]], list[Use]],
    transform: np.ndarray,
    record: Mapping,
    found: Findings,
) -> None:
    """Nothing that a program goes to stays under the base of a target of it that moved, unless it was refused."""
    changed = {
        (path, was.span)
        for path, literals in before.literals.items()
        for was, now in zip(literals, after.literals.get(path, []), strict=False)
        if was.texts != now.texts
    }
    moved = {_used(use) for place, ways in uses.items() if place in changed for use in ways if use.base is not None}
    programs = {item["program"].lower() for item in record["refused"]}
    targets = {item["target"].lower() for item in record["refused"]}
    for place, ways in uses.items():
        for use in ways:
            literal = use.literal
            told = Path(use.program).stem.lower() in programs or literal.name.lower() in targets
            if (
                place not in changed
                and use.base is not None
                and _used(use) in moved
                and not told
                and _goes(use, transform)
            ):
                found.wrong.append(f"{literal.path}:{literal.line} {literal.name}: left behind")


def _used(use: Use) -> tuple[str, bool, bytes]:
    assert use.base is not None
    return use.program, use.external, use.base.round(6).tobytes()


def _goes(use: Use, transform: np.ndarray) -> bool:
    """Whether a literal must change: its numbers, to the digits that a changed one has at least."""
    assert use.base is not None
    seen, literal = in_base(use.base, transform), use.literal
    if literal.offset:
        way = literal.values("XYZ" if literal.language == "krl" else "xyz")
        return bool((np.abs(seen[:3, :3] @ way - way) > 1e-3).any())
    return literal.complete and bool((np.abs((seen @ literal.pose - literal.pose)[:3, 3]) > 1e-3).any())


# ---------------------------------------------------------------------------------------------------------------- back


def judge_back(
    old: Mapping[str, bytes], back: Mapping[str, bytes], edits: list[dict], configurations: bool = True
) -> Findings:
    """Judge what a conversion and its inverse left of the original: header and last digits apart, nothing changed.

    Without ``configurations`` status, turn and confdata may differ: where they were kept unchecked on one of both ways.
    """
    found = Findings()
    edited = {edit["path"] for edit in edits}
    if set(old) != set(back):
        found.wrong.append(f"other files: {sorted(set(old) ^ set(back))[:3]}")
        return found
    found.wrong += [f"{path}: not byte-identical" for path in old if path not in edited and old[path] != back[path]]
    before, after = read(old), read(back)
    for path in sorted(edited):
        pairs = list(_pairs(path, before, after, found))
        _judge_rest(path, before, after, pairs, found)
        for was, now in pairs:
            problem = _not_restored(was, now, configurations)
            if problem:
                found.wrong.append(f"{path}:{was.line} {was.name}: {problem}")
            else:
                found.restored += 1
    return found


def _not_restored(was: Literal, now: Literal, configurations: bool) -> str:
    orientation = ORIENTATION[was.language]
    by_lock = was.language == "krl" and was.complete and abs(np.cos(np.radians(was.values("B")[0]))) < LOCK_COSINE
    steep = 1.0 / abs(np.cos(np.radians(was.values("B")[0]))) if was.language == "krl" and "B" in was.texts else 1.0
    for name, text in was.texts.items():
        digit = 2.0 * max(half_digit(text), 0.5e-11)
        if name in orientation and decimals(text) > 4:  # what is lost in the pose is more in A and C
            digit *= steep
        if (by_lock and name in "AC") or (name in CONFIGURATION[was.language] and not configurations):
            continue
        away = abs(float("".join(now.texts[name].split()).strip("'B")) - float("".join(text.split()).strip("'B")))
        if name in orientation and was.language == "krl":
            away = min(away, abs(away - 360.0))
        if away > digit:
            return f"{name} was {text} and is {now.texts[name]}"
    if by_lock and (turn := angle_between(was.pose, now.pose)) > 4.0 * half_digit(was.texts["A"]):
        return f"is turned by {turn:.6f} degrees"
    added = [name for name in now.texts if name not in was.texts and abs(float(now.texts[name])) > 1.01e-3]
    return f"got {added}" if added else ""
