"""A change of any one token of any fixture is seen: as a finding, or named as noise for a reason."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from respot.difference import compare
from respot.difference.record import as_record
from respot.issues import BadInputError

DATA = Path(__file__).parents[1] / "data"
SAMPLES = Path(__file__).parents[2] / "samples" / "rear_door"
PROGRAMS = sorted(
    path
    for folder in (DATA, SAMPLES)
    for path in folder.rglob("*")
    if path.suffix in (".src", ".dat", ".mod", ".sys", ".modx") and path.is_file()
)
#: A number or a word that is not part of a longer one.
TOKEN = re.compile(rb"(?<![\w.$\"'%&+])(?:\d+\.?\d*|[A-Za-z]\w{3,})(?![\w.\"'%])")
#: Why a change may be noise, by what the line or the program says.
REASONS = {"header", "last_used", "drift", "comments", "folds", "respot"}


def changed(data: bytes, dice: random.Random) -> tuple[bytes, bytes] | None:
    """Change one token outside of comments and strings; also the line that it stands in."""
    lines = data.split(b"\n")
    places = [
        (number, match)
        for number, line in enumerate(lines)
        for match in TOKEN.finditer(re.split(rb"[;!]", line)[0])
        if b'"' not in line
    ]
    if not places:
        return None
    number, match = dice.choice(places)
    token = match[0]
    new = token.replace(token[:1], b"7" if token[:1] != b"7" else b"3", 1) if token[:1].isdigit() else token + b"_X"
    line = lines[number]
    lines[number] = line[: match.start()] + new + line[match.end() :]
    return b"\n".join(lines), lines[number]


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_one_changed_token_is_seen(path, tmp_path):
    dice = random.Random(path.name)
    for attempt in range(4):
        made = changed(path.read_bytes(), dice)
        if made is None:
            return
        folder = tmp_path / str(attempt)
        (folder / "old").mkdir(parents=True)
        (folder / "new").mkdir()
        (folder / "old" / path.name).write_bytes(path.read_bytes())
        (folder / "new" / path.name).write_bytes(made[0])
        try:
            comparison = compare(folder / "old" / path.name, folder / "new" / path.name)
        except BadInputError:
            return  # a fixture that is no program any more, or holds none by itself
        noise = {item["kind"] for robot in as_record(comparison)["robots"] for item in robot["noise"]}
        assert not comparison.same or noise & REASONS, made[1]
